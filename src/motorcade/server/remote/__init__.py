"""The remote: pages that drive cars and show the pictures of their cameras."""
