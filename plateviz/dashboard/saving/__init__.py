"""What leaves the dashboard: tables, reports, code, and tables to programs of the same machine."""
