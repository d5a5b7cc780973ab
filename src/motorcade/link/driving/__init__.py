"""What the two ends of driving are made of: `motorcade.link.drive_server` and `motorcade.link.drive_client` join it."""
