"""Real hardware of a computer that runs Linux."""
