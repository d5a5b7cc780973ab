"""The remote: pages that drive cars by hand, and show what their cameras see."""
