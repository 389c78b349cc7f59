"""What people see of a result: sentences, tables and pictures, for terminal, notebook and page.

`motion`, `stability`, `points` and `file` make a `View` (`view`) of the names of `--json`: a title, an answer
in sentences, rows and tables. `render` writes values with their units, `terminal` lines of text.

`plots/` draws a result of any kind (`plots.result.plot_result`), `reports/` puts results on one page
(`reports.page.write_report`), `accessor` adds records and pictures to objects of xarray.

Views compute nothing: what they show was computed in `studies` and stands in a file.
"""
