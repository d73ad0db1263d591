"""Self-contained HTML pages that play files in a browser."""
