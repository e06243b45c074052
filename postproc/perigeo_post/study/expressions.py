"""Expressions in study files: arithmetic on the parameters of a run, or on the table of runs.

Only what stands in `_OPERATORS`, `FUNCTIONS` and `TABLE_FUNCTIONS` is understood; a text is parsed
once, checked as a whole, and then evaluated for as many runs as there are. Nothing of Python's own
`eval` is used.
"""

from __future__ import annotations

import ast
import difflib
import math
import operator
import statistics
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Callable

from ..read.errors import RequestError

LONGEST = 2000  # characters of an expression
LARGEST_POWER = 1000.0  # bits of the result of a power of whole numbers


class ExpressionError(RequestError):
    """An expression that cannot be understood, or has no value."""


class MissingValueError(RequestError):
    """A number of the table of runs is not there."""


def nearest(word: str, known: Iterable[str]) -> str:
    """ ", did you mean 'name'?" for a misspelt name, or nothing."""
    found = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f", did you mean '{found[0]}'?" if found else ""


# ---- lists of numbers ------------------------------------------------------------------------


class Numbers:
    """Numbers of some runs. Arithmetic goes run by run: over those that both sides have."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.by_run = dict(values)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.by_run.values())

    def __len__(self) -> int:
        return len(self.by_run)

    @property
    def values(self) -> list[Any]:
        return list(self.by_run.values())

    def mapped(self, function: Callable[[Any], Any]) -> Numbers:
        """A function of every number."""
        return Numbers({run: function(value) for run, value in self.by_run.items()})

    def joined(self, other: Numbers, function: Callable[[Any, Any], Any]) -> Numbers:
        """A function of the numbers of every run that both have."""
        runs = [run for run in self.by_run if run in other.by_run]
        if not runs and (self.by_run or other.by_run):
            raise MissingValueError("the two columns have no run in common")
        return Numbers({run: function(self.by_run[run], other.by_run[run]) for run in runs})


def _both(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def apply(left: Any, right: Any) -> Any:
        if isinstance(left, Numbers) and isinstance(right, Numbers):
            return left.joined(right, function)
        if isinstance(left, Numbers):
            return left.mapped(lambda value: function(value, right))
        if isinstance(right, Numbers):
            return right.mapped(lambda value: function(left, value))
        return function(left, right)

    return apply


def _arithmetic(function: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def apply(left: Any, right: Any) -> Any:
        for value in (left, right):
            if not isinstance(value, (int, float)):
                raise ExpressionError(f"{_shown(value)} is no number")
        return function(left, right)

    return _both(apply)


def _power(base: Any, exponent: Any) -> Any:
    if isinstance(base, int) and isinstance(exponent, int) and exponent > 0:
        if base.bit_length() * exponent > LARGEST_POWER:
            raise ExpressionError("a power is too large")
    elif base == 0 and exponent < 0:
        raise ZeroDivisionError
    result = base**exponent
    if isinstance(result, complex):
        raise ExpressionError(f"{base} to the power of {exponent} is no real number")
    return result


_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: _arithmetic(operator.add),
    ast.Sub: _arithmetic(operator.sub),
    ast.Mult: _arithmetic(operator.mul),
    ast.Div: _arithmetic(operator.truediv),
    ast.FloorDiv: _arithmetic(operator.floordiv),
    ast.Mod: _arithmetic(operator.mod),
    ast.Pow: _arithmetic(_power),
}
_COMPARISONS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Eq: _both(operator.eq),
    ast.NotEq: _both(operator.ne),
    ast.Lt: _both(operator.lt),
    ast.LtE: _both(operator.le),
    ast.Gt: _both(operator.gt),
    ast.GtE: _both(operator.ge),
    ast.In: lambda left, right: left in _listed(right),
    ast.NotIn: lambda left, right: left not in _listed(right),
}


def _shown(value: Any) -> str:
    return f"'{value}'" if isinstance(value, str) else f"{value}"


# ---- functions -------------------------------------------------------------------------------


def _listed(value: Any) -> list[Any]:
    if isinstance(value, Numbers):
        return value.values
    if isinstance(value, list):
        return value
    raise ExpressionError(f"a list is needed, not {_shown(value)}")


def _each(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def apply(value: Any) -> Any:
        if isinstance(value, Numbers):
            return value.mapped(function)
        if isinstance(value, list):
            return [function(item) for item in value]
        return function(value)

    return apply


def _round(value: Any, digits: Any = None) -> Any:
    return _each(lambda item: round(item) if digits is None else round(item, int(digits)))(value)


def _some(function: Callable[[list[Any]], Any]) -> Callable[..., Any]:
    """A function of the numbers given, or of a list of them; there must be one at least."""

    def apply(*values: Any) -> Any:
        items = _listed(values[0]) if len(values) == 1 else list(values)
        if not items:
            raise MissingValueError("there are no values")
        return function(items)

    return apply


def _ratio(items: list[Any]) -> float:
    if min(items) <= 0:
        raise ExpressionError("the ratio of largest to smallest needs values above 0")
    return float(max(items) / min(items))


def _slope(x: Any, y: Any) -> float:
    """Slope of the straight line nearest to y over x, by least squares."""
    if isinstance(x, Numbers) and isinstance(y, Numbers):
        both = x.joined(y, lambda a, b: (a, b)).values
    else:
        both = list(zip(_listed(x), _listed(y)))
    if len({a for a, _ in both}) < 2:
        raise MissingValueError("a slope needs two different x")
    mean_x = statistics.fmean(a for a, _ in both)
    mean_y = statistics.fmean(b for _, b in both)
    above = sum((a - mean_x) * (b - mean_y) for a, b in both)
    return float(above / sum((a - mean_x) ** 2 for a, _ in both))


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": _each(abs),
    "ceil": _each(math.ceil),
    "cos": _each(math.cos),
    "exp": _each(math.exp),
    "floor": _each(math.floor),
    "float": _each(float),
    "int": _each(int),
    "log": _each(math.log),
    "max": _some(max),
    "min": _some(min),
    "round": _round,
    "sin": _each(math.sin),
    "sqrt": _each(math.sqrt),
    "tan": _each(math.tan),
}
TABLE_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **FUNCTIONS,
    "all": _some(all),
    "any": _some(any),
    "len": lambda value: len(_listed(value)),
    "mean": _some(statistics.fmean),
    "median": _some(statistics.median),
    "ratio": _some(_ratio),
    "slope": _slope,
    "sorted": lambda value: sorted(_listed(value)),
    "sum": _some(sum),
}
CONSTANTS: dict[str, Any] = {"pi": math.pi}


# ---- an expression ---------------------------------------------------------------------------

_PLAIN = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Name,
    ast.Constant, ast.List, ast.Tuple, ast.Call, ast.keyword, ast.Subscript,
    ast.Load, ast.USub, ast.UAdd, ast.Not, ast.And, ast.Or, *_OPERATORS, *_COMPARISONS,
)  # fmt: skip


class Expression:
    """A text that has been parsed and contains nothing that is not allowed."""

    def __init__(self, text: str) -> None:
        self.text = text.strip()
        if len(self.text) > LONGEST:
            raise ExpressionError(f"the expression has more than {LONGEST} characters")
        try:
            self._tree = ast.parse(self.text, mode="eval")
        except SyntaxError as error:
            raise ExpressionError(f"'{self.text}' is no expression: {error.msg}") from None
        except (ValueError, MemoryError, RecursionError):
            raise ExpressionError(f"'{self.text}' is no expression") from None
        self.names: list[str] = []
        self.calls: list[ast.Call] = []
        try:
            self._look_through(self._tree.body)
        except RecursionError:
            raise ExpressionError("the expression is nested too deeply") from None

    def _look_through(self, node: ast.AST) -> None:
        if not isinstance(node, _PLAIN):
            kind = type(node).__name__
            raise ExpressionError(f"'{self.text}': not allowed in an expression: {kind}")
        if isinstance(node, ast.Constant) and not isinstance(
            node.value, (bool, int, float, str, type(None))
        ):
            raise ExpressionError(f"'{self.text}': not allowed in an expression: {node.value!r}")
        if isinstance(node, ast.Call):
            if not isinstance(node.func, ast.Name) or any(k.arg is None for k in node.keywords):
                raise ExpressionError(f"'{self.text}': only plain calls of functions are allowed")
            self.calls.append(node)
            for part in [*node.args, *node.keywords]:
                self._look_through(part)
            return
        if isinstance(node, ast.Name):
            self.names.append(node.id)
        for part in ast.iter_child_nodes(node):
            self._look_through(part)

    def check_names(self, names: Iterable[str], functions: Iterable[str]) -> None:
        """Raise for a name or a function that will not be there."""
        known = [*names, *CONSTANTS]
        for name in self.names:
            if name not in known:
                raise ExpressionError(
                    f"'{self.text}': unknown name {name}{nearest(name, known)}; "
                    f"allowed: {', '.join(known)}"
                )
        known = sorted(functions)
        for name in self.called:
            if name not in known:
                raise ExpressionError(
                    f"'{self.text}': unknown function {name}{nearest(name, known)}; "
                    f"allowed: {', '.join(known)}"
                )

    @property
    def called(self) -> list[str]:
        """Names of the functions that are called."""
        return [call.func.id for call in self.calls if isinstance(call.func, ast.Name)]

    def value(
        self,
        names: Mapping[str, Any],
        functions: Mapping[str, Callable[..., Any]] = FUNCTIONS,
    ) -> Any:
        """What the expression gives with these names and functions."""
        self.check_names(names, functions)
        try:
            result = _evaluate(self._tree.body, {**CONSTANTS, **names}, functions)
        except ZeroDivisionError:
            raise ExpressionError(f"'{self.text}': division by zero") from None
        except OverflowError:
            raise ExpressionError(f"'{self.text}': a number is too large") from None
        except (ExpressionError, MissingValueError) as error:
            raise type(error)(f"'{self.text}': {error}") from None
        except (TypeError, ValueError, IndexError, KeyError) as error:
            raise ExpressionError(f"'{self.text}': {error}") from None
        if isinstance(result, float) and not math.isfinite(result):
            raise ExpressionError(f"'{self.text}' is no finite number")
        return result


def _evaluate(
    node: ast.AST, names: Mapping[str, Any], functions: Mapping[str, Callable[..., Any]]
) -> Any:
    def of(part: ast.AST) -> Any:
        return _evaluate(part, names, functions)

    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.Name):
        return names[node.id]
    if isinstance(node, (ast.List, ast.Tuple)):
        return [of(item) for item in node.elts]
    if isinstance(node, ast.BinOp):
        return _OPERATORS[type(node.op)](of(node.left), of(node.right))
    if isinstance(node, ast.UnaryOp):
        value = of(node.operand)
        if isinstance(node.op, ast.Not):
            return not value
        return _arithmetic(operator.mul)(-1 if isinstance(node.op, ast.USub) else 1, value)
    if isinstance(node, ast.BoolOp):
        stops_at = isinstance(node.op, ast.Or)
        value = None
        for part in node.values:
            value = of(part)
            if bool(value) == stops_at:
                break
        return value
    if isinstance(node, ast.IfExp):
        return of(node.body) if of(node.test) else of(node.orelse)
    if isinstance(node, ast.Subscript):
        place = of(node.slice)
        if not isinstance(place, int):
            raise ExpressionError("only a whole number may stand in [ ]")
        items = _listed(of(node.value))
        if not -len(items) <= place < len(items):
            raise MissingValueError(f"there is no value number {place}")
        return items[place]
    if isinstance(node, ast.Compare):
        return _compare(node, of)
    assert isinstance(node, ast.Call)
    assert isinstance(node.func, ast.Name)
    keywords = {str(k.arg): of(k.value) for k in node.keywords}
    return functions[node.func.id](*[of(part) for part in node.args], **keywords)


def _compare(node: ast.Compare, of: Callable[[ast.AST], Any]) -> Any:
    """A chain like 1 < x <= 2; one of lists gives a list."""
    left = of(node.left)
    result: Any = True
    for kind, part in zip(node.ops, node.comparators):
        right = of(part)
        found = _COMPARISONS[type(kind)](left, right)
        if isinstance(found, Numbers) or isinstance(result, Numbers):
            result = _both(lambda a, b: bool(a and b))(result, found)
        else:
            result = found
            if not found:
                return False
        left = right
    return result
