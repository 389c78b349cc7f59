"""What a user gives: case files, read with every problem at once, and a case in numbers."""
