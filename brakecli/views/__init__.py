"""What people see of a result: a view of its answer, numbers and tables, for terminal, notebook and page."""
