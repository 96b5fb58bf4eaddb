"""What people read: terminal, HTML, PDF and figures."""
