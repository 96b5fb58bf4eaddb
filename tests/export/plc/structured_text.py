"""A reader of the Structured Text that is exported: tokens, grammar and evaluation of its own, by IEC 61131-3.

The text is parsed and turned into Python, whose floats are LREAL. Names have no case. What is not of the subset fails.
"""

from __future__ import annotations

import copy
import functools
import math
import re
from types import CodeType
from typing import Any

TOKEN = re.compile(
    r"\s*(?:\(\*.*?\*\)\s*)*(?:(?P<number>\d+\.\d+(?:[Ee][+-]?\d+)?)|(?P<word>[A-Za-z](?:_?[A-Za-z0-9])*)"
    r"|(?P<sign>:=|<=|>=|<>|[-+*/()<>=;:,.])|(?P<end>$))",
    re.DOTALL,
)
WORDS = """
    type end_type struct end_struct function end_function function_block end_function_block var var_input
    var_output end_var if then else elsif end_if and or not true false lreal bool abs sqrt sin cos on of s r n p l d q
    t by do
"""
KEYWORDS = frozenset(WORDS.split())
STANDARD = {"abs": "abs", "sqrt": "sqrt", "sin": "sin", "cos": "cos"}


def tokens(text: str) -> list[tuple[str, str]]:
    """Kind and text of every token; words in lower case. Nothing but ASCII."""
    text.encode("ascii")
    found, place = [], 0
    while place < len(text):
        match = TOKEN.match(text, place)
        if match is None:
            raise SyntaxError(f"no token at: {text[place : place + 40]!r}")
        place = match.end()
        kind = str(match.lastgroup)
        word = match[kind].lower()
        found.append(("keyword" if kind == "word" and word in KEYWORDS else kind, word))
        if kind == "end":
            break
    return found


COMPARED = {"=": "==", "<>": "!=", "<": "<", ">": ">", "<=": "<=", ">=": ">="}


class Parser:
    """Recursive descent; writes Python as it goes."""

    def __init__(self, text: str, *, compares: bool = False) -> None:
        self.tokens, self.place, self.compares, self.counted = tokens(text), 0, compares, 0
        self.structures: dict[str, list[tuple[str, str, float | None]]] = {}
        self.functions: dict[str, list[str]] = {}
        self.python: list[str] = []
        self.inputs: list[str] = []
        self.outputs: list[str] = []
        self.scope: dict[str, str] = {}

    # Tokens

    def next(self, *expected: str) -> str:
        _kind, text = self.tokens[self.place]
        if expected and text not in expected:
            raise SyntaxError(f"{text!r} where {expected} is wanted, token {self.place}")
        self.place += 1
        return text

    def at(self, *texts: str) -> bool:
        return self.tokens[self.place][1] in texts

    def name(self) -> str:
        kind, text = self.tokens[self.place]
        if kind != "word":
            raise SyntaxError(f"{text!r} where a name is wanted")
        self.place += 1
        return text

    # Declarations

    def parse(self) -> None:
        while self.tokens[self.place][0] != "end":
            word = self.next("type", "function", "function_block")
            if word == "type":
                self.types()
            else:
                self.unit(word == "function")

    def types(self) -> None:
        while not self.at("end_type"):
            name = self.new(self.structures, self.name())
            self.next(":")
            self.next("struct")
            members: dict[str, str] = {}
            lines = []
            while not self.at("end_struct"):
                member, kind, initial = self.declaration(members)
                lines.append((member, kind, initial))
            self.structures[name] = lines
            self.next("end_struct")
            self.next(";")
        self.next("end_type")

    @staticmethod
    def new(known: Any, name: str) -> str:
        if name in known:
            raise SyntaxError(f"{name} is declared twice")
        return name

    def declaration(self, known: dict[str, str]) -> tuple[str, str, Any]:
        name = self.new(known, self.name())
        self.next(":")
        kind = self.next()
        if kind not in ("lreal", "bool") and kind not in self.structures:
            raise SyntaxError(f"unknown type {kind}")
        initial: Any = None
        if self.at(":="):
            self.next()
            sign = -1.0 if self.at("-") and self.next() else 1.0
            text = self.next()
            initial = {"true": True, "false": False}.get(text)
            initial = sign * float(text) if initial is None else initial
        self.next(";")
        known[name] = kind
        return name, kind, initial

    def first(self, kind: str, initial: Any) -> Any:
        """First value of a variable."""
        if kind in self.structures:
            return Structure({n: self.first(k, i) for n, k, i in self.structures[kind]})
        return (0.0 if kind == "lreal" else False) if initial is None else initial

    def unit(self, function: bool) -> None:
        name = self.new(self.functions, self.name())
        if function:
            self.next(":")
            self.next("lreal", "bool")
        self.scope = {}
        groups: dict[str, list[tuple[str, str, Any]]] = {"var_input": [], "var_output": [], "var": []}
        while self.at(*groups):
            group = groups[self.next()]
            while not self.at("end_var"):
                group.append(self.declaration(self.scope))
            self.next("end_var")
        inputs = [n for n, _, _ in groups["var_input"]]
        self.functions[name] = inputs
        self.assignable = {n for g in ("var_output", "var") for n, _, _ in groups[g]} | ({name} if function else set())
        self.readable = set(self.scope)
        body = self.statements(2, "end_function" if function else "end_function_block")
        self.next()
        if function:
            self.python.append(f"def f_{name}({', '.join('v_' + n for n in inputs)}):")
            for n, kind, initial in groups["var"]:
                self.python.append(f"    v_{n} = {self.first(kind, initial)!r}")
            self.python += [line.replace(f"v_{name} =", "result =") for line in body] + ["        return result"]
            self.python[-len(body) - 1 :] = [line[4:] for line in self.python[-len(body) - 1 :]]
            return
        held = [d for g in ("var", "var_output") for d in groups[g]]
        self.inputs = [n for n, kind, _ in groups["var_input"] if kind in ("lreal", "bool")]
        self.outputs = [n for n, _, _ in groups["var_output"]]
        self.settings = {n: self.first(kind, i) for n, kind, i in groups["var_input"] if kind in self.structures}
        self.python.append(f"def make({', '.join('v_' + n for n in self.settings)}):")
        self.python += [f"    v_{n} = {self.first(kind, i)!r}" for n, kind, i in held]
        self.python.append(f"    def step({', '.join('v_' + n for n in self.inputs)}):")
        self.python.append(f"        nonlocal {', '.join('v_' + n for n, _, _ in held)}")
        self.python += body
        self.python.append(f"        return ({', '.join('v_' + n for n in self.outputs)},)")
        self.python.append("    return step")

    # Statements

    def statements(self, depth: int, *ends: str) -> list[str]:
        lines, pad = [], "    " * depth
        while not self.at(*ends):
            if self.at("if"):
                self.next()
                lines.append(f"{pad}if {self.expression()}:")
                self.next("then")
                lines += self.statements(depth + 1, "else", "end_if")
                if self.next() == "else":
                    lines.append(f"{pad}else:")
                    lines += self.statements(depth + 1, "end_if")
                    self.next()
            else:
                name = self.name()
                if name not in self.assignable:
                    raise SyntaxError(f"{name} cannot be assigned to")
                self.next(":=")
                lines.append(f"{pad}v_{name} = {self.expression()}")
            self.next(";")
        return lines or [f"{pad}pass"]

    # Expressions, from the loosest operator to the tightest

    def expression(self) -> str:
        return self.chain({"or": "or"}, self.conjunction)

    def conjunction(self) -> str:
        return self.chain({"and": "and"}, self.comparison)

    def comparison(self) -> str:
        if not self.compares:
            return self.chain(COMPARED, self.sum)
        text = self.sum()
        while self.at("=", "<>", "<", ">", "<=", ">="):
            sign, n = self.next(), self.counted
            self.counted += 1
            python = COMPARED[sign]
            a, b = f"a_{n}", f"b_{n}"
            numbers = f"(({a} := {text}) == {a}) & (({b} := {self.sum()}) == {b})"  # both are evaluated
            text = f"({a} {python} {b} if {numbers} else compare({sign!r}, {a}, {b}))"
        return text

    def sum(self) -> str:
        return self.chain({"+": "+", "-": "-"}, self.product)

    def product(self) -> str:
        return self.chain({"*": "*", "/": "/"}, self.unary)

    def chain(self, operators: dict[str, str], operand: Any) -> str:
        text = operand()
        while self.at(*operators):
            text = f"({text} {operators[self.next()]} {operand()})"
        return str(text)

    def unary(self) -> str:
        if self.at("-", "not"):
            return f"({'-' if self.next() == '-' else 'not '}{self.unary()})"
        return self.primary()

    def primary(self) -> str:
        kind, text = self.tokens[self.place]
        if kind == "number":
            self.place += 1
            return repr(float(text))
        if text == "(":
            self.next()
            inner = self.expression()
            self.next(")")
            return inner
        if text in ("true", "false"):
            return self.next().capitalize()
        if text in STANDARD:
            self.next()
            self.next("(")
            inner = self.expression()
            self.next(")")
            return f"{STANDARD[text]}({inner})"
        name = self.name()
        if self.at("("):
            return self.call(name)
        if name not in self.readable:
            raise SyntaxError(f"{name} is not declared")
        path = f"v_{name}"
        kind = self.scope[name]
        while self.at("."):
            self.next()
            member = self.name()
            kind = {n: k for n, k, _ in self.structures[kind]}[member]
            path += f".{member}"
        return path

    def call(self, name: str) -> str:
        inputs = self.functions[name]
        given = {}
        self.next("(")
        while True:
            own = self.name()
            self.next(":=")
            given[own] = self.expression()
            if self.next(",", ")") == ")":
                break
        if list(given) != inputs:
            raise SyntaxError(f"{name} takes {inputs}, not {list(given)}")
        return f"f_{name}({', '.join(given.values())})"


class Structure:
    """Values of a structure."""

    def __init__(self, members: dict[str, Any]) -> None:
        vars(self).update(members)


@functools.cache
def parsed(text: str, compares: bool) -> tuple[Parser, CodeType]:
    """A text that was read, and its Python; with compares, comparisons with NaN are left to a function."""
    parser = Parser(text, compares=compares)
    parser.parse()
    return parser, compile("\n".join(parser.python), "<structured text>", "exec")


class Machine:
    """The function block of a text, ready to run. compare(sign, a, b): a comparison of a PLC of its own kind."""

    def __init__(self, text: str, compare: Any = None) -> None:
        parser, code = parsed(text, compare is not None)
        names: dict[str, Any] = {name: getattr(math, name) for name in ("sqrt", "sin", "cos")} | {"compare": compare}
        exec(code, names)
        self.inputs, self.outputs, self.parser = parser.inputs, parser.outputs, parser
        self.settings = copy.deepcopy(parser.settings)
        self.make = names["make"]

    def start(self) -> Any:
        """A block before its first cycle: call it with the inputs, in their order, for the outputs."""
        return self.make(**{f"v_{name}": value for name, value in self.settings.items()})
