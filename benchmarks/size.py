"""How much the package weighs, and what in it is too long: `make size`.

Weighed are names, operators, numbers and texts, the tokens of Python without comments and docstrings, of each
room and in all. Counted is what makes code hard to read: assignments that pack unlike things into one line,
calls with starred arguments, `Any`, numbers at the top of modules, private pieces of Numba, and names that say
nothing of what they name. Named are files beyond 500 lines, functions beyond 80 lines, and signatures beyond
eight arguments. Options of commands and functions of `import brakecli` may have more.
"""

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "brakecli"
FILE_LINES = 500
FUNCTION_LINES = 80
ARGUMENTS = 8
WEIGHED = (tokenize.NAME, tokenize.OP, tokenize.NUMBER, tokenize.STRING)
PRIVATE = re.compile(
    r"numba\.core|numba\.np\b|_library_class|_optimize_final|_HAVE_BLAS|CPUDispatcher|IndexDataCacheFile"
    r"|_cache_file|_index_key|__class__ =|no_cpython_wrapper|no_cfunc_wrapper"
)
"""What of Numba is not promised to stay."""
EMPTY = {
    "each",
    "found",
    "part",
    "place",
    "known",
    "rest",
    "left",
    "held",
    "told",
    "given",
    "seen",
    "asked",
    "kept",
}
"""Words that do not name things: they change their meaning from room to room."""
Documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def is_text(node: ast.stmt) -> bool:
    """Whether a statement is nothing but a text."""
    return (
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    )


def tokens(text: str, tree: ast.Module) -> int:
    """Names, operators, numbers and texts of a module, its docstrings left out."""
    documented = [node for node in ast.walk(tree) if isinstance(node, Documented) and node.body]
    docstrings = {node.body[0].lineno for node in documented if is_text(node.body[0])}
    count = 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        documents = token.type == tokenize.STRING and token.start[0] in docstrings
        count += token.type in WEIGHED and not documents
    return count


def is_packed(node: ast.AST) -> bool:
    """Whether an assignment packs several things that have nothing to do with each other; swaps do not."""
    if not isinstance(node, ast.Assign):
        return False
    left = node.targets[0]
    if not (isinstance(left, ast.Tuple) and isinstance(node.value, ast.Tuple)):
        return False
    assigned = {each.id for each in ast.walk(left) if isinstance(each, ast.Name)}
    used = {each.id for each in ast.walk(node.value) if isinstance(each, ast.Name)}
    return not assigned & used


def is_starred(node: ast.AST) -> bool:
    """Whether a call has starred arguments."""
    return isinstance(node, ast.Call) and any(isinstance(each, ast.Starred) for each in node.args)


def holds_a_number(node: ast.stmt) -> bool:
    """Whether a statement at the top of a module gives a name to what contains a number."""
    if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
        return False
    constants = [each for each in ast.walk(node.value) if isinstance(each, ast.Constant)]
    return any(type(each.value) in (int, float) for each in constants)


def names_nothing(node: ast.AST) -> bool:
    """Whether a name, or the use of one, is a word that does not name a thing."""
    for kind, attribute in ((ast.Name, "id"), (ast.Attribute, "attr"), (ast.arg, "arg"), (ast.keyword, "arg")):
        if isinstance(node, kind):
            return str(getattr(node, attribute)).strip("_") in EMPTY
    return isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name.strip("_").lower() in EMPTY


def counts(text: str, tree: ast.Module) -> Counter[str]:
    """What is counted in one module, by its name."""
    found = Counter[str]()
    found["tokens"] = tokens(text, tree)
    found["files"] = 1
    for node in ast.walk(tree):
        found["functions"] += isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        found["packed assignments"] += is_packed(node)
        found["starred calls"] += is_starred(node)
        found["names of nothing"] += names_nothing(node)
        found["Any"] += isinstance(node, ast.Name) and node.id == "Any"
    found["numbers at module level"] = sum(map(holds_a_number, tree.body))
    found["private Numba"] = len(PRIVATE.findall(text))
    return found


def lines_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its docstring."""
    first = function.body[0]
    text = (first.end_lineno or first.lineno) - first.lineno + 1 if is_text(first) else 0
    return (function.end_lineno or function.lineno) - function.lineno + 1 - text


def arguments_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """How many arguments a function has, `self` left out."""
    named = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return sum(each.arg not in ("self", "cls") for each in named)


def too_long(name: Path, text: str, tree: ast.Module) -> Iterator[str]:
    """The file, its functions and their signatures, where they are too long."""
    count = text.count("\n")
    if count > FILE_LINES:
        yield f"{name}: {count} lines"
    is_face = name.parts[0] in ("cli", "api")
    for node in ast.walk(tree):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if (count := lines_of(node)) > FUNCTION_LINES:
            yield f"{name}:{node.lineno}: {node.name} has {count} lines"
        if (count := arguments_of(node)) > ARGUMENTS and not is_face:
            yield f"{name}:{node.lineno}: {node.name} has {count} arguments"


def main(package: Path = PACKAGE) -> None:
    """Print the weight, the counts, and what is too long."""
    rooms = Counter[str]()
    total = Counter[str]()
    long = list[str]()
    for path in sorted(package.rglob("*.py")):
        text = path.read_text()
        name = path.relative_to(package)
        tree = ast.parse(text)
        found = counts(text, tree)
        total.update(found)
        rooms[name.parts[0]] += found["tokens"]
        long += too_long(name, text, tree)
    print(", ".join(f"{count:,} {name}" for name, count in total.items()))
    print(", ".join(f"{room} {count:,}" for room, count in rooms.most_common()))
    print(*long, f"{len(long)} files, functions and signatures are too long", sep="\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
