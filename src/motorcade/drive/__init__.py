"""What the two ends of driving are made of: `motorcade.drive.server` and `motorcade.drive.client` join it."""
