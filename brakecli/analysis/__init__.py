"""What can be said of a case or of a history: pure functions, no files, no stepping."""
