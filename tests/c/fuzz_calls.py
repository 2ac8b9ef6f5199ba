# SPDX-License-Identifier: BSD-3-Clause
"""Random calls of every function of dyop_c.h, read from the header, in child processes.

Usage: fuzz_calls.py LIBRARY COUNT [SEED]       LIBRARY: the C interface as a shared library

A child makes some hundred calls, writes each of them down before it is made, and calls again from
callbacks. Arguments are mostly legal, with values at the edges, null pointers, stale handles and
structs of wrong sizes; arrays are as long as their counts say, since no library can check that. A
crash, a call that does not end, a status that nothing explains and a failure without a message are
printed with the call, and make the exit code 1.
"""

import ctypes
import os
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HEADER = Path(__file__).resolve().parents[2] / "include/dyop/dyop_c.h"
CALLS_PER_CHILD = 200
PATIENCE = 120  # seconds for a child
OK, INVALID, STALE, UNSUPPORTED, NO_MEMORY, INTEGRATION, INTERNAL = range(7)
SIMPLE = {
    "double": ctypes.c_double, "float": ctypes.c_float, "int": ctypes.c_int, "char": ctypes.c_char,
    "int32_t": ctypes.c_int32, "uint32_t": ctypes.c_uint32, "int64_t": ctypes.c_int64,
    "uint64_t": ctypes.c_uint64, "uint8_t": ctypes.c_uint8, "size_t": ctypes.c_size_t,
}
# Arrays whose length is not what the next count says, or else the last one before.
ROWS = {"points": 3, "centers": 3, "vertices": 3, "triangles": 3, "begin": 3, "end": 3, "witnesses": 8}
# Where a caller can ask for endless work: usual values, and those at the edges.
CAREFUL = {
    "dt": ([0.01, 0.1], [0.0, -1.0, 1e-300, float("nan"), float("inf")]),
    "max_step": ([0.0, 0.05], [-1.0, float("nan")]),
    "seconds": ([0.01, 0.1], [0.0, -1.0, float("nan")]),
    "max_node_pairs": ([100, 1000], [1, 0, -1]),
    "thread_count": ([1], [-1]),
    "sleep_steps": ([50, 1], [0, -1]),
    "samples": ([10, 0], [-1]),
    "max_boxes": ([10, 1000], [0, -1]),
}
# What random arguments would seldom make.
STARTERS = """sphere_create box_create mesh_create hull_create rest_create constant_twist_create
interpolated_create world_create world_add_body world_add_body world_add_body world_add_joint
world_add_spring world_snapshot obstacle_set_create obstacle_add obstacle_add chain_create joint_path_create
robot_create deforming_mesh_create haptic_session_create haptic_session_create_tools""".split()
NOT_ARRAYS = {"options", "properties", "functions", "values"}
# A zero handle is legal there: none.
OPTIONAL_HANDLES = {("dyop_certify", "obstacles")}
CONTAINERS = {"dyop_world", "dyop_obstacle_set"}
PARTS = {"dyop_body", "dyop_joint", "dyop_spring", "dyop_snapshot", "dyop_obstacle"}


class Header:
    """Structs as ctypes, and functions: (result, name, [(type, name, pointers, is_const, length)])."""

    def __init__(self):
        text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(encoding="utf-8"), flags=re.S)
        self.types, self.callbacks, self.fields = dict(SIMPLE), {}, {}
        for name in re.findall(r"^typedef enum (\w+)", text, flags=re.M):
            self.types[name] = ctypes.c_int
        pattern = r"^typedef void \(\*(\w+)\)\((.*?)\);|^typedef struct (\w+) \{(.*?)^\} \w+;"
        for match in re.finditer(pattern, text, flags=re.S | re.M):
            callback, arguments, struct, body = match.groups()
            if callback:
                self.types[callback] = self.function_type("void", arguments)
            else:
                self.types[struct] = self.struct(struct, body)
        calls = re.findall(r"^DYOP_C_API ([\w ]+?[ *]+)(\w+)\((.*?)\);", text, flags=re.S | re.M)
        self.functions = [
            (result.replace(" ", ""), name, self.arguments(arguments))
            for result, name, arguments in calls
        ]

    def arguments(self, text):
        if re.fullmatch(r"\s*void\s*", text):
            return []
        if "(*" in text:
            return [("callback", "handler", 0, False, None)]
        found = []
        for part in text.split(","):
            is_const, kind, stars, name, length = re.fullmatch(
                r"\s*(const )?(\w+) ?(\**) ?(\w+)(?:\[(\d+)\])?\s*", part, flags=re.S
            ).groups()
            pointers = len(stars) + (1 if length else 0)
            found.append((kind, name, pointers, bool(is_const), int(length) if length else None))
        return found

    def function_type(self, result, arguments):
        kinds = []
        for part in arguments.split(","):
            kind, stars = re.match(r"\s*(?:const )?(\w+) ?(\**)", part).groups()
            kinds.append(ctypes.c_void_p if stars else self.types[kind])
        results = {"void": None, "int": ctypes.c_int, "void*": ctypes.c_void_p}
        return ctypes.CFUNCTYPE(results[result.replace(" ", "")], *kinds)

    def struct(self, name, body):
        fields = []
        for line in body.split(";"):
            line = " ".join(line.split())
            callback = re.fullmatch(r"(\w+ ?\*?) ?\(\*(\w+)\)\((.*)\)", line)
            if callback:
                fields.append((callback[2], self.function_type(callback[1], callback[3])))
            elif line.startswith("void*"):
                fields.append((line.split()[-1], ctypes.c_void_p))
            elif line:
                kind, names = line.split(" ", 1)
                for field in names.split(", "):
                    word, length = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", field).groups()
                    base = self.types[kind]
                    fields.append((word, base * int(length) if length else base))
        self.fields[name] = fields
        return type(name, (ctypes.Structure,), {"_fields_": fields})

    def is_handle(self, kind):
        words = [name for name, _ in self.fields.get(kind, [])]
        return words in (["index", "generation"], ["number"])

    def is_sized(self, kind):
        return self.fields.get(kind, [("", None)])[0][0] == "size"


def key(handle):
    return tuple(getattr(handle, name) for name, _ in handle._fields_)


class Fuzzer:
    def __init__(self, library, seed, log):
        self.header = Header()
        self.library = ctypes.CDLL(library)
        self.random = random.Random(seed)
        self.log, self.kept = log, []
        self.live = {}  # (context, type): [(handle, the container it is part of)]
        self.depth, self.running, self.calls, self.problems = 0, {}, 0, 0
        for result, name, _ in self.header.functions:
            results = {"void": None, "constchar*": ctypes.c_char_p, "uint32_t": ctypes.c_uint32}
            getattr(self.library, name).restype = results.get(result, ctypes.c_int)
        self.contexts = []
        self.new_context()

    def new_context(self):
        context = ctypes.c_void_p()
        assert self.library.dyop_context_create(None, ctypes.byref(context)) == OK
        self.contexts.append(context.value)
        self.start(context.value)

    # --- Values

    def number(self):
        edges = [0.0, -0.0, 1.0, -1.0, 0.5, 1e-3, 1e6, 1e300, -1e300, 5e-324]
        edges += [float("inf"), float("-inf"), float("nan")]
        return self.random.choice(edges if self.random.random() < 0.06 else [self.random.uniform(0.1, 3)])

    def integer(self, kind):
        value = self.random.choice([0, 1, 1, 2, 3, 5] if self.random.random() < 0.9 else [-1, 255, 2**31, -(2**40)])
        return kind(value).value

    def handle(self, kind, context, owner):
        known = self.live.get((context, kind), [])
        near = [h for h, part_of in known if part_of == owner] if kind in PARTS else [h for h, _ in known]
        made = self.header.types[kind]()
        roll = self.random.random()
        if near and roll < 0.94:
            ctypes.memmove(ctypes.byref(made), ctypes.byref(self.random.choice(near)), ctypes.sizeof(made))
        elif roll < 0.97:
            for name, _ in made._fields_:
                setattr(made, name, self.random.choice([0, 1, 2, 7, 0xFFFFFFFF]))
        return made

    def fill(self, value, context, owner):
        """Random fields; of a quaternion mostly a unit one."""
        for name, kind in value._fields_:
            type_name = kind.__name__
            if name in ("size", "reserved", "reserved_too", "user"):
                continue
            if self.header.is_handle(type_name):
                setattr(value, name, self.handle(type_name, context, owner))
            elif type_name in self.header.fields:
                self.fill(getattr(value, name), context, owner)
            elif name == "rotation" and self.random.random() < 0.95:
                value.rotation[:] = self.random.choice([[1, 0, 0, 0], [0.6, 0, 0.8, 0], [0, 0, 0, -1]])
            elif name == "inertia" and self.random.random() < 0.9:
                value.inertia[:] = [1, 0, 0, 0, 1, 0, 0, 0, 1]
            elif hasattr(kind, "_length_"):
                getattr(value, name)[:] = [self.scalar(name, kind._type_) for _ in range(kind._length_)]
            elif hasattr(kind, "_restype_"):
                setattr(value, name, self.callback(name, kind, context))
            else:
                setattr(value, name, self.scalar(name, kind))

    def scalar(self, name, kind):
        if name in CAREFUL:
            return self.random.choice(CAREFUL[name][self.random.random() < 0.05])
        return self.number() if kind is ctypes.c_double else self.integer(kind)

    def struct(self, kind, context, owner, size=None):
        """The bytes of a struct: defaults, some fields changed, in memory of just its size."""
        value = self.header.types[kind]()
        fields = self.header.fields[kind]
        if not self.header.is_sized(kind):
            self.fill(value, context, owner)
            return bytes(value)
        make = getattr(self.library, kind + "_init", None)
        if make is None or make(ctypes.byref(value), ctypes.c_uint32(ctypes.sizeof(value))) != OK:
            self.fill(value, context, owner)
        else:
            # Few fields at a time are other than the defaults.
            other = self.header.types[kind]()
            self.fill(other, context, owner)
            for name, field in fields:
                rare = 0.15 if "allocate" not in name else 0
                wanted = self.header.is_handle(field.__name__) or name in CAREFUL
                wanted = wanted or kind.endswith("functions") or name in ("initial", "kind", "stiffness")
                if name not in ("size", "reserved") and (wanted or self.random.random() < rare):
                    setattr(value, name, getattr(other, name))
        if kind == "dyop_haptic_options" and self.random.random() < 0.8:
            value.rest_offset, value.recovery_speed = 0.01, 1
            value.coupling.stiffness[:] = value.coupling.rotational_stiffness[:] = [100] * 3
        if kind == "dyop_haptic_tool" and self.random.random() < 0.9:
            value.part_count, value.hinge_count = 2, 0
        full = ctypes.sizeof(value)
        value.size = full if size is None else size
        return bytes(value)[: value.size].ljust(value.size, self.random.choice([b"\0", b"\0", b"\1"]))

    def struct_size(self, kind):
        full = ctypes.sizeof(self.header.types[kind])
        return full if self.random.random() < 0.95 else self.random.choice([4, full - 8, full + 8, full + 64])

    def memory(self, data):
        """A copy in memory of its own, whose ends a sanitizer guards."""
        made = (ctypes.c_char * max(len(data), 1))()
        ctypes.memmove(made, data, len(data))
        return made

    def array(self, kind, count, is_const, context, owner):
        if kind == "char":
            return self.memory(b"name\0" if is_const else b"x" * count)
        if kind in SIMPLE:
            base = SIMPLE[kind]
            values = [self.scalar("", base) for _ in range(count)]
            if kind == "int32_t" and self.random.random() < 0.9:
                values = [self.random.randrange(4) for _ in range(count)]
            return self.memory(bytes((base * count)(*values)))
        if self.header.is_handle(kind):
            return self.memory(b"".join(bytes(self.handle(kind, context, owner)) for _ in range(count)))
        size = self.struct_size(kind) if self.header.is_sized(kind) else None
        if is_const:
            made = [self.struct(kind, context, owner, size) for _ in range(count)]
            if kind == "dyop_chain_joint" and self.random.random() < 0.8:
                # A chain, one link after another, whose joints all move.
                made = [m[:4] + bytes((ctypes.c_int32 * 3)(1, i, i + 1)) + m[16:] for i, m in enumerate(made)]
            return self.memory(b"".join(made))
        size = size or ctypes.sizeof(self.header.types[kind])
        # An output; of sized ones the first says how large all are.
        first = ctypes.c_uint32(size) if self.header.is_sized(kind) else b""
        return self.memory((bytes(first) + b"\xee" * (size * count))[: size * count])

    # --- Callbacks

    def callback(self, name, kind, context):
        if self.random.random() < (0.05 if name in ("state", "twist_bound") else 0.3):
            return kind()
        own = random.Random(self.random.random())

        def again():
            if own.random() < 0.05 and self.depth < 3:
                self.random, kept = own, self.random
                try:
                    self.call(context if context in self.contexts and own.random() < 0.9 else None)
                finally:
                    self.random = kept

        def write(address, kind, *values):
            made = self.header.types[kind].from_address(address)
            ctypes.memset(address, 0, ctypes.sizeof(made))
            for field, value in values:
                target = getattr(made, field)
                target[:] = value

        worst = own.random() < 0.1

        def state(_, t, out):
            again()
            ctypes.memset(out, 0, ctypes.sizeof(self.header.types["dyop_state"]))
            made = self.header.types["dyop_state"].from_address(out)
            made.pose.rotation[0] = 0 if worst else 1
            made.pose.position[0] = t

        def twist_bound(_, interval, out):
            write(out, "dyop_twist_bound")
            self.header.types["dyop_twist_bound"].from_address(out).linear_speed = 0 if worst else 1.01

        def wrench(_, t, state_at, out):
            again()
            write(out, "dyop_wrench", ("force", [0, 0, float("nan") if worst else 9.81 * t]))

        def plain(*_):
            again()
            return 0 if worst else own.randrange(2)

        made = kind({"state": state, "twist_bound": twist_bound, "wrench": wrench}.get(name) or (
            lambda *a: None if kind._restype_ is None and plain(*a) is not None else plain(*a)))
        self.kept.append(made)
        return made

    # --- Calls

    def start(self, context):
        for name in STARTERS:
            kept = self.living(context)
            for _ in range(20):
                if self.living(context) == kept and context in self.contexts:
                    self.call(context, "dyop_" + name)

    def living(self, context):
        return sum(len(handles) for (of, _), handles in self.live.items() if of == context)

    def call(self, context=None, only=None):
        functions = [f for f in self.header.functions if only in (None, f[1])]
        result, name, wanted = self.random.choice(functions)
        if re.search("_destroy|_remove|_init", name) and self.random.random() < 0.8:
            return
        context = context or self.random.choice(self.contexts)
        owner = None
        arguments, words, made, handles = [], [], [], []
        counts = {n: self.random.choice([0, 1, 2, 4, 4, 5]) for k, n, p, _, _ in wanted if k == "size_t" and not p}
        usual = {"dyop_mesh_create": {"vertex_count": 4, "triangle_count": 4},
                 "dyop_mesh_refit": {"vertex_count": 4},
                 "dyop_chain_create": {"link_count": 3, "joint_count": 2},
                 "dyop_chain_poses": {"coordinate_count": 2, "link_count": 3},
                 "dyop_certify": {"waypoint_count": 3, "coordinate_count": 2},
                 "dyop_joint_path_create": {"waypoint_count": 3, "coordinate_count": 2},
                 "dyop_joint_path_position": {"coordinate_count": 2},
                 "dyop_robot_limits": {"free_count": 2},
                 "dyop_robot_expand": {"free_count": 2, "coordinate_count": 2},
                 "dyop_deforming_mesh_create": {"vertex_count": 4, "triangle_count": 4},
                 "dyop_deforming_mesh_refit": {"vertex_count": 4},
                 "dyop_haptic_session_create": {"hinge_count": 0, "obstacle_count": 1},
                 "dyop_haptic_session_create_tools": {"tool_count": 2, "part_count": 4, "hinge_count": 0,
                                                     "obstacle_count": 1},
                 "dyop_haptic_give_snapshot": {"vertex_count": 4},
                 "dyop_haptic_give_mesh": {"vertex_count": 4, "triangle_count": 4}}
        if self.random.random() < 0.85:
            counts.update(usual.get(name, {}))
        names = [n for _, n, _, _, _ in wanted]
        for place, (kind, argument, pointers, is_const, length) in enumerate(wanted):
            value = None
            if kind == "dyop_context" and pointers == 1:
                value = ctypes.c_void_p(context if self.random.random() < 0.995 else None)
            elif pointers and (self.random.random() < 0.02 or kind == "void"):
                value = None
            elif kind == "dyop_context":
                value = ctypes.byref(ctypes.c_void_p())
            elif kind == "callback":
                value = None
            elif pointers:
                count = length or 1
                if name.endswith("_init"):
                    # Memory as large as the size that follows says.
                    data = self.memory(b"\xee" * (ctypes.sizeof(self.header.types[kind]) + 64))
                    value = data
                else:
                    later = [n for n in names[place:] if n in counts] + [n for n in names[:place][::-1] if n in counts]
                    is_array = later and length is None and re.fullmatch("text|.*s|children|lower|upper|begin|end", argument)
                    is_array = is_array and argument not in NOT_ARRAYS
                    if is_array:
                        count = counts[later[0]] * ROWS.get(argument, 1)
                        if argument == "free_coordinates":
                            count = counts["free_count"]
                        if argument == "waypoints":
                            count = counts["waypoint_count"] * counts["coordinate_count"]
                        if argument == "heights":
                            count = counts["rows"] * counts["columns"]
                    if argument == "triangles" and count == 12 and self.random.random() < 0.8:
                        value = self.memory(bytes((ctypes.c_int32 * 12)(0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2)))
                    elif argument == "times" and self.random.random() < 0.9:
                        value = self.memory(bytes((ctypes.c_double * count)(*range(count))))
                    else:
                        value = self.array(kind, count, is_const, context, owner)
                    if self.header.is_handle(kind) and not is_const and not is_array:
                        made.append((kind, value))
            elif kind == "size_t":
                value = ctypes.c_size_t(counts[argument])
            elif self.header.is_handle(kind):
                value = self.handle(kind, context, owner)
                if kind in CONTAINERS:
                    owner = (kind, key(value))
                handles.append((kind, argument, value))
            elif kind == "dyop_interval":
                value = self.header.types[kind](*self.random.choice([(0, 1), (0, 1), (0, 0.5), (1, 0), (self.number(), self.number())]))
            elif kind == "dyop_wrench_callback":
                value = self.callback("wrench", self.header.types[kind], context)
            elif name.endswith("_init") and argument == "size":
                full = ctypes.sizeof(self.header.types[wanted[0][0]])
                value = ctypes.c_uint32(self.random.choice([full, full, full + 8, full + 64, full - 8, 4, 0]))
            else:
                base = self.header.types[kind]
                value = base(self.scalar(argument, base))
            arguments.append(value)
            words.append(f"{argument}={self.show(value)}")
        self.make(context, result, name, arguments, words, made, handles, owner)

    def show(self, value):
        if isinstance(value, ctypes.Structure):
            return str(key(value))
        if isinstance(value, ctypes.Array):
            return value.raw[:400].hex()
        return str(getattr(value, "value", value))

    def is_live(self, context, kind, value):
        return any(key(handle) == key(value) for handle, _ in self.live.get((context, kind), []))

    def make(self, context, result, name, arguments, words, made, handles, owner):
        text = "  " * self.depth + f"{name}({', '.join(words)})"
        self.log.write(text + "\n")
        self.log.flush()
        stale = [a for k, a, h in handles if k not in PARTS - {"dyop_snapshot"}
                 and not self.is_live(context, k, h) and ((name, a) not in OPTIONAL_HANDLES or key(h) != (0, 0))]
        self.depth += 1
        self.calls += 1
        self.running[context] = self.running.get(context, 0) + 1
        try:
            answer = getattr(self.library, name)(*arguments)
        finally:
            self.depth -= 1
            self.running[context] -= 1
        if name == "dyop_context_destroy":
            if arguments[0].value and self.running[context] == 0:
                self.contexts.remove(context)
                self.live = {k: v for k, v in self.live.items() if k[0] != context}
                if not self.contexts:
                    self.new_context()
        elif result == "dyop_status":
            self.check(context, name, text, answer, stale, arguments)
            self.book(context, name, answer, arguments, made, handles, owner)

    def check(self, context, name, text, answer, stale, arguments):
        problem = None
        if answer not in range(INTERNAL):
            problem = "an internal error" if answer == INTERNAL else "no status"
        elif answer == NO_MEMORY:
            problem = "out of memory"
        elif answer == OK and stale and self.depth == 0:
            problem = f"well with stale {stale}"
        elif answer != OK and arguments[0] is not None and "_init" not in name and name != "dyop_last_error":
            told = ctypes.create_string_buffer(4000)
            if name != "dyop_context_create" and arguments[0].value:
                self.library.dyop_last_error(ctypes.c_void_p(context), told, ctypes.c_size_t(4000))
                message = told.value.decode("utf-8", "replace")
                if not message or "std::" in message or "\ufffd" in message:
                    problem = f"the message '{message}'"
        if problem:
            self.problems += 1
            told = ctypes.create_string_buffer(2000)
            self.library.dyop_last_error(ctypes.c_void_p(context), told, ctypes.c_size_t(2000))
            print(f"wrong: {answer}: {problem}: {told.value!r}\n  {text}", flush=True)

    def book(self, context, name, answer, arguments, made, handles, owner):
        if answer != OK or context not in self.contexts:
            return
        if name == "dyop_context_create":
            fresh = arguments[1]._obj.value
            if len(self.contexts) < 3:
                self.contexts.append(fresh)
            else:
                self.library.dyop_context_destroy(ctypes.c_void_p(fresh))
            return
        removes = name.endswith("_destroy") or "_remove" in name
        if removes and handles:
            kind, _, gone = handles[-1]
            known = self.live.get((context, kind), [])
            known[:] = [(h, o) for h, o in known if key(h) != key(gone) or (kind in PARTS and o != owner)]
        elif any(word in name for word in ("_create", "_add", "_refit", "snapshot")):
            for kind, data in made:
                handle = self.header.types[kind].from_buffer_copy(data)
                self.live.setdefault((context, kind), []).append((handle, owner))


def make_calls(library, count, seed, log):
    fuzzer = Fuzzer(library, seed, log)
    while fuzzer.calls < count:
        fuzzer.call()
    for context in fuzzer.contexts:
        fuzzer.library.dyop_context_destroy(ctypes.c_void_p(context))
    return fuzzer.problems


def run_child(library, count, seed):
    """None if all is well, else what went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "calls.log"
        command = [sys.executable, "-X", "faulthandler", os.path.abspath(__file__), "--child"]
        command += [os.path.abspath(library), str(count), str(seed), str(log)]
        environment = dict(os.environ)
        if "FUZZ_PRELOAD" in environment:
            environment["LD_PRELOAD"] = environment["FUZZ_PRELOAD"]
        try:
            done = subprocess.run(command, env=environment, capture_output=True, text=True,
                                  timeout=PATIENCE, errors="replace", cwd=folder)
        except subprocess.TimeoutExpired:
            return f"seed {seed}: does not end:\n  {last_line(log)}"
        faults = [line for line in done.stderr.splitlines() if "runtime error:" in line]
        if done.returncode == 0 and not faults:
            return None
        if done.returncode == 1 and not faults:
            return f"seed {seed}: {done.stdout}{done.stderr[-2000:]}"
        return f"seed {seed}: ended with {done.returncode}:\n  {last_line(log)}\n{faults[:3]}\n{done.stderr[:6000]}"


def last_line(log):
    lines = log.read_text().splitlines() if log.exists() else []
    return lines[-1] if lines else "(before the first call)"


def main(arguments):
    if arguments[:1] == ["--child"]:
        library, count, seed, log_path = arguments[1:]
        # One processor, and so one thread: callbacks come in the same order in every run.
        processors = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {processors[int(seed) % len(processors)]})
        with open(log_path, "w", encoding="ascii", errors="backslashreplace") as log:
            return 1 if make_calls(library, int(count), int(seed), log) else 0
    library, count, seed = arguments[0], int(arguments[1]), int((arguments + ["0"])[2])
    failures = 0
    for start in range(0, count, CALLS_PER_CHILD):
        problem = run_child(library, min(CALLS_PER_CHILD, count - start), seed + start)
        if problem is not None:
            failures += 1
            print(problem, flush=True)
    print(f"{count} calls, {failures} children with faults")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
