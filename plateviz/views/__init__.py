"""Views: they connect the session to the pictures, and compute nothing themselves."""
