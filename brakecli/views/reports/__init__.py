"""Results as a page to read, to print and to send."""
