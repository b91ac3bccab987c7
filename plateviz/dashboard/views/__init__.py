"""Views: connect the session to tables and figures, without computations of their own."""
