"""What is on the screen of a session: view, run, orbit, source and axes, without Panel."""
