"""Views on a terminal: as wide as that is, no word broken, and nothing that its cells hold taken for markup."""

from collections.abc import Mapping, Sequence
from itertools import groupby

from brakecli.errors import escaped
from brakecli.views.view import Row, Table, View


def terminal_text(view: View, *, details: bool = False) -> str:
    """A view as text, with all that is known if `details`."""
    shown = view if details else view.short()
    parts = ["\n".join(filter(None, [heading(view.title), prose(" ".join(view.answer))]))]
    for kind, blocks in groupby(shown.blocks, type):
        if kind is Row:
            rows = [row for row in blocks if isinstance(row, Row)]
            parts.append(two_columns([(row.label, row.text) for row in rows]))
        else:
            for table in blocks:
                if isinstance(table, Table):
                    title = prose(f"{table.title}:") if table.title else ""
                    parts.append("\n" + "\n".join(filter(None, [title, grid(table.columns, table.keys)])))
    return "\n".join(filter(None, parts)).lstrip("\n")


def heading(title: str) -> str:
    """A title in italics, in as many lines as it takes."""
    return grid({"": [title]}, show_header=False, style="italic") if title else ""


def prose(text: str) -> str:
    """Sentences in lines as wide as the terminal."""
    return grid({"": [text]}, show_header=False) if text else ""


def two_columns(rows: Sequence[tuple[str, str]]) -> str:
    """Labels beside their texts."""
    labels = [label for label, _ in rows]
    texts = [text for _, text in rows]
    return grid({"label": labels, "value": texts}, show_header=False)


def grid(columns: Mapping[str, Sequence[str]], keys: int = 1, *, show_header: bool = True, style: str = "") -> str:
    """Columns under their headers, as wide as the terminal; words are kept whole up to half of that.

    Columns that do not fit beside the others follow below, behind the first `keys` columns.
    """
    from rich.cells import cell_len
    from rich.console import Console
    from rich.table import Table as RichTable

    console = Console(markup=False, emoji=False, highlight=False)  # titles and file names are not markup
    room = max(console.width, 40)  # columns, whatever the terminal says: nothing can be read in fewer
    console.width = room
    texts = {escaped(header): [*map(escaped, cells)] for header, cells in columns.items()}
    heads = {header: header if show_header else "" for header in texts}
    most = {header: max(map(cell_len, (heads[header], *cells))) for header, cells in texts.items()}
    words = {header: " ".join((heads[header].replace(".", ". "), *texts[header])).split() for header in texts}
    least = {header: min(max(map(cell_len, words[header]), default=0), room // 2) for header in texts}
    names = [*texts]
    while len(names) > keys + 1 and sum(least[name] + 2 for name in names) > room + 2:
        names.pop()
    table = RichTable(box=None, padding=(0, 2, 0, 0), pad_edge=False, show_header=show_header)
    for cap in range(room, 0, -1):
        widths = {name: min(most[name], max(least[name], cap)) for name in names}
        if sum(width + 2 for width in widths.values()) <= room + 2:
            break
    for name, width in widths.items():
        header = name if cell_len(name) <= width else name.replace(".", ".\n")
        bold = "bold" if name == "label" else style or None
        table.add_column(header, overflow="fold", width=width, style=bold)
    for line in zip(*map(texts.get, names), strict=True):
        table.add_row(*line)
    with console.capture() as shown:
        console.print(table)
    others = {name: texts[name] for name in (*names[:keys], *[*texts][len(names) :])}
    below = ["", grid(others, keys)] if len(names) < len(texts) else []
    return "\n".join([*(line.rstrip() for line in shown.get().splitlines()), *below])
