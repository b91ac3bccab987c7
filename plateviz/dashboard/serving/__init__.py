"""Serving: pages before their sessions, limits and headers, and what the libraries do slowly."""
