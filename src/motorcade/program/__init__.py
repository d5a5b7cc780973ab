"""The user's programs: steps, compiled into words and back."""
