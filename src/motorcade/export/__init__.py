"""Export the words to other tools: files made from the declared formats, the same bytes on every machine."""
