"""Keys and certificates of cars and drivers."""
