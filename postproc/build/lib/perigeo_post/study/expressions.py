"""Expressions in study files: arithmetic on the parameters of a run, or on the table of runs.

simpleeval evaluates them. Which forms, operators and functions there are is listed here; a text is
parsed once, checked as a whole, and then evaluated for as many runs as there are.
"""

from __future__ import annotations

import ast
import difflib
import math
import operator
import statistics
from collections.abc import Iterable, Iterator, Mapping
from functools import partial, reduce
from typing import Any, Callable

from simpleeval import EvalWithCompoundTypes, InvalidExpression, safe_power

from ..read.errors import RequestError

LONGEST = 2000  # characters of an expression


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

    def __getitem__(self, place: int) -> Any:
        return self.values[place]

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
        result = function(left, right)
        if isinstance(result, complex):
            raise ExpressionError(f"{left} to the power of {right} is no real number")
        return result

    return _both(apply)


_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: _arithmetic(operator.add),
    ast.Sub: _arithmetic(operator.sub),
    ast.Mult: _arithmetic(operator.mul),
    ast.Div: _arithmetic(operator.truediv),
    ast.FloorDiv: _arithmetic(operator.floordiv),
    ast.Mod: _arithmetic(operator.mod),
    ast.Pow: _arithmetic(safe_power),
    ast.UAdd: partial(_arithmetic(operator.mul), 1),
    ast.USub: partial(_arithmetic(operator.mul), -1),
    ast.Not: operator.not_,
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
    if isinstance(value, (list, tuple)):
        return list(value)
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


def _deviation(values: list[Any]) -> float:
    """Standard deviation of a sample."""
    if len(values) < 2:
        raise MissingValueError("a standard deviation or error needs two values")
    return float(statistics.stdev(values))


def _standard_error(values: list[Any]) -> float:
    """Standard error of the mean of a sample."""
    return _deviation(values) / math.sqrt(len(values))


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
    "deviation": _some(_deviation),
    "len": lambda value: len(_listed(value)),
    "mean": _some(statistics.fmean),
    "median": _some(statistics.median),
    "ratio": _some(_ratio),
    "slope": _slope,
    "sorted": lambda value: sorted(_listed(value)),
    "standard_error": _some(_standard_error),
    "sum": _some(sum),
}
CONSTANTS: dict[str, Any] = {"pi": math.pi}


# ---- an expression ---------------------------------------------------------------------------

_FORMS = (
    ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Name, ast.Constant, ast.List,
    ast.Tuple, ast.Call, ast.keyword, ast.Subscript, ast.Load, ast.And, ast.Or, *_OPERATORS,
)  # fmt: skip


class _Evaluator(EvalWithCompoundTypes):  # type: ignore[misc]
    """simpleeval, where a chain like 1 < x <= 2 of lists gives a list."""

    def __init__(self, names: Mapping[str, Any], functions: Mapping[str, Any]) -> None:
        super().__init__(_OPERATORS, dict(functions), {**CONSTANTS, **names})
        self.nodes[ast.Compare] = self._chain

    def _chain(self, node: ast.Compare) -> Any:
        sides = [self._eval(part) for part in (node.left, *node.comparators)]
        pairs = zip(node.ops, sides, sides[1:])
        found = [_OPERATORS[type(kind)](left, right) for kind, left, right in pairs]
        return reduce(_both(lambda one, other: bool(one and other)), found)


class Expression:
    """A text that has been parsed and contains nothing that is not allowed."""

    def __init__(self, text: str) -> None:
        self.text = text.strip()
        if len(self.text) > LONGEST:
            raise ExpressionError(f"the expression has more than {LONGEST} characters")
        try:
            self._tree = ast.parse(self.text, mode="eval").body
        except SyntaxError as error:
            raise ExpressionError(f"'{self.text}' is no expression: {error.msg}") from None
        except (ValueError, MemoryError, RecursionError):
            raise ExpressionError(f"'{self.text}' is no expression") from None
        nodes = list(ast.walk(self._tree))
        self.calls = [node for node in nodes if isinstance(node, ast.Call)]
        for node in nodes:
            self._allow(node)
        functions = [call.func for call in self.calls]
        self.names = [
            node.id for node in nodes if isinstance(node, ast.Name) and node not in functions
        ]

    def _allow(self, node: ast.AST) -> None:
        """Raise unless this part of the expression is one that the language has."""
        if isinstance(node, ast.Call) and (
            not isinstance(node.func, ast.Name) or any(k.arg is None for k in node.keywords)
        ):
            raise ExpressionError(f"'{self.text}': only plain calls of functions are allowed")
        found = "" if isinstance(node, _FORMS) else type(node).__name__
        if isinstance(node, ast.Constant) and not isinstance(
            node.value, (bool, int, float, str, type(None))
        ):
            found = repr(node.value)
        if found:
            raise ExpressionError(f"'{self.text}': not allowed in an expression: {found}")

    def check_names(self, names: Iterable[str], functions: Iterable[str]) -> None:
        """Raise for a name or a function that will not be there."""
        called = [call.func.id for call in self.calls if isinstance(call.func, ast.Name)]
        for what, used, known in (
            ("name", self.names, [*names, *CONSTANTS]),
            ("function", called, sorted(functions)),
        ):
            for name in used:
                if name not in known:
                    raise ExpressionError(
                        f"'{self.text}': unknown {what} {name}{nearest(name, known)}; "
                        f"allowed: {', '.join(known)}"
                    )

    def value(
        self,
        names: Mapping[str, Any],
        functions: Mapping[str, Callable[..., Any]] = FUNCTIONS,
    ) -> Any:
        """What the expression gives with these names and functions."""
        self.check_names(names, functions)
        try:
            result = _Evaluator(names, functions).eval(self.text, self._tree)
        except ZeroDivisionError:
            raise ExpressionError(f"'{self.text}': division by zero") from None
        except OverflowError:
            raise ExpressionError(f"'{self.text}': a number is too large") from None
        except RecursionError:
            raise ExpressionError("the expression is nested too deeply") from None
        except MissingValueError as error:
            raise MissingValueError(f"'{self.text}': {error}") from None
        except (
            ExpressionError, InvalidExpression, TypeError, ValueError, IndexError, KeyError,
        ) as error:  # fmt: skip
            raise ExpressionError(f"'{self.text}': {error}") from None
        if isinstance(result, float) and not math.isfinite(result):
            raise ExpressionError(f"'{self.text}' is no finite number")
        return result
