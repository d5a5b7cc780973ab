"""What a driver holds: keys, gamepads, sticks."""
