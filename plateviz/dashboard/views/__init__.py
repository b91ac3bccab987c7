"""Views: they connect the session to tables and figures, and compute nothing."""
