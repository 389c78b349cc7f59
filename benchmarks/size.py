"""How large the package is: `make size`.

Counted are statements without docstrings, of each room and in all. Named are files beyond 350 lines, functions
beyond 60 lines, and signatures beyond eight arguments. Options of commands and functions of `import brakecli` may
have more.
"""

import ast
from collections import Counter
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "brakecli"
FILE_LINES, FUNCTION_LINES, ARGUMENTS = 350, 60, 8


def statements(tree: ast.Module) -> int:
    """Statements of a module, its docstrings left out."""
    return sum(isinstance(node, ast.stmt) and not is_docstring(node) for node in ast.walk(tree))


def is_docstring(node: ast.stmt) -> bool:
    """Whether a statement is nothing but a text."""
    return (
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    )


def lines_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring."""
    documented = function.body[0] if is_docstring(function.body[0]) else None
    text = documented.end_lineno - documented.lineno + 1 if documented and documented.end_lineno else 0
    return (function.end_lineno or function.lineno) - function.lineno + 1 - text


def arguments_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """How many arguments a function has, `self` left out."""
    named = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return sum(each.arg not in ("self", "cls") for each in named)


def main() -> None:
    """Print the counts, and what is too long."""
    rooms, long = Counter[str](), list[str]()
    for path in sorted(PACKAGE.rglob("*.py")):
        text, name = path.read_text(), path.relative_to(PACKAGE)
        tree = ast.parse(text)
        rooms[name.parts[0]] += statements(tree)
        if (count := text.count("\n")) > FILE_LINES:
            long.append(f"{name}: {count} lines")
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                faces = name.parts[0] in ("cli", "api")
                if (count := lines_of(node)) > FUNCTION_LINES:
                    long.append(f"{name}:{node.lineno}: {node.name} has {count} lines")
                if (count := arguments_of(node)) > ARGUMENTS and not faces:
                    long.append(f"{name}:{node.lineno}: {node.name} has {count} arguments")
    print(*(f"{count:6d} {room}" for room, count in rooms.most_common()), sep="\n")
    print(f"{sum(rooms.values()):6d} statements in all")
    print(*long, f"{len(long)} files, functions and signatures are too long", sep="\n")


if __name__ == "__main__":
    main()
