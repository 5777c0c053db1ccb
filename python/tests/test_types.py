"""The types that type checkers read agree with the package."""

import ast
import inspect
from pathlib import Path

import pytest

import aforce
from aforce import _native

PACKAGE = Path(aforce.__file__).parent
STUB = ast.parse((PACKAGE / "_native.pyi").read_text())
VALUE = "a value"


def public(name):
    return not name.startswith("_") or name in ("__new__", "__version__")


def takes(function, skipped=0):
    """The parameters as Python writes them, without the first `skipped` ones."""
    parameters = list(inspect.signature(function).parameters.values())
    return str(inspect.Signature(parameters[skipped:]))


def untyped(definition):
    """A function with the parameters of a definition in the stub, without their types."""
    for node in ast.walk(definition.args):
        if isinstance(node, ast.arg):
            node.annotation = None
    return eval(f"lambda {ast.unparse(definition.args)}: None")


def of_module():
    """Every public name of the module, and what it takes."""
    found = {}
    for name, member in vars(_native).items():
        if not public(name):
            continue
        if not isinstance(member, type):
            found[name] = takes(member) if callable(member) else VALUE
            continue
        for part, value in vars(member).items():
            if part == "__new__":
                found[f"{name}.{part}"] = takes(member)
            elif public(part):
                found[f"{name}.{part}"] = takes(value, 1) if callable(value) else VALUE
    return found


def of_stub():
    """Every public name of the stub, and what it takes."""
    found = {}
    for node in STUB.body:
        match node:
            case ast.AnnAssign(target=ast.Name(id=name)) if public(name):
                found[name] = VALUE
            case ast.FunctionDef(name=name):
                found[name] = takes(untyped(node))
            case ast.ClassDef(name=name):
                for part in (part for part in node.body if isinstance(part, ast.FunctionDef)):
                    is_value = [ast.unparse(decorator) for decorator in part.decorator_list] == ["property"]
                    found[f"{name}.{part.name}"] = VALUE if is_value else takes(untyped(part), 1)
    return found


def test_the_stub_is_the_module():
    assert of_stub() == of_module()
    (exported,) = (node.value for node in STUB.body if isinstance(node, ast.Assign))
    assert sorted(ast.literal_eval(exported)) == sorted(_native.__all__)


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py*")), ids=lambda path: path.name)
def test_everything_has_a_type(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef):
            every = [argument for argument in ast.walk(node.args) if isinstance(argument, ast.arg)]
            untyped = {argument.arg for argument in every if argument.annotation is None}
            assert node.returns and untyped <= {"self", "cls"}, f"{path.name}:{node.lineno}"


def test_checkers_are_told_that_there_are_types():
    assert (PACKAGE / "py.typed").is_file()
