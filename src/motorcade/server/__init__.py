"""What every server of pages here needs: a guard, an address to listen at, and what is said to who may not."""
