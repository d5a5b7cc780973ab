"""Pictures from cars, real and simulated."""
