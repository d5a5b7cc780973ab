"""A simulated microcontroller and the parts of a car at its pins. Portable, as the code that runs on it."""
