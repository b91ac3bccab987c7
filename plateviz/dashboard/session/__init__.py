"""The solutions of a browser session and their rules, without Panel; views watch it."""
