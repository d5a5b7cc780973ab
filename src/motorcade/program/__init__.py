"""What the user means: steps, compiled into words and back."""
