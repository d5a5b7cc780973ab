"""The words for other tools: each target is made from the declared formats alone, with the same bytes everywhere."""
