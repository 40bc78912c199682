"""Exact values for the tests of `isoswarm_field::math`, to standard output.

Each line: function, x, y (0 where the function takes one argument) as hexadecimal bits, the exact value rounded to
double as bits, and the rest (exact - rounded) in units of 2^-20 ulp of it. Needs only mpmath.

    python3 math_reference.py > ../tests/data/math_reference.txt
"""

import math
import random
import struct

import mpmath as mp

mp.mp.prec = 300
random.seed(20)
U = random.uniform


def log_uniform(lo, hi):
    return math.exp(U(math.log(lo), math.log(hi)))


def signed(x):
    return random.choice((-1, 1)) * x


def wobble(x):
    for _ in range(random.randint(0, 3)):
        x = math.nextafter(x, signed(math.inf))
    return x


def near_one():
    return 1 + signed(log_uniform(1e-15, 0.1))


def trig():
    half_pi = wobble(float(random.randint(-1_000_000, 1_000_000) * mp.pi / 2))
    quarter_pi = wobble(float(random.randint(-40, 40) * mp.pi / 4))
    return random.choice((U(-1, 1), U(-20, 20), U(-1.6e6, 1.6e6), half_pi, quarter_pi, signed(log_uniform(1e-30, 1))))


def unit():
    return random.choice((U(-1, 1), signed(U(0.49, 0.6)), signed(1 - 10 ** U(-16, -1)), signed(log_uniform(1e-30, 1))))


def exponent():
    border = wobble(float((random.randint(-1000, 1000) + 0.5) * mp.log(2)))
    return random.choice((U(-1, 1), U(-708, 709), border, signed(log_uniform(1e-20, 1)), U(-745, -708)))


def positive():
    return random.choice((U(0.5, 2), near_one(), log_uniform(1e-300, 1e300), log_uniform(5e-324, 1e-308)))


def slope():
    border = random.choice((0.4375, 0.6875, 1, 1 / 0.6875, 1 / 0.4375))
    return random.choice((U(-5, 5), signed(log_uniform(1e-30, 1e30)), signed(border + U(-0.01, 0.01))))


def power():
    return random.choice(
        (
            (U(0.01, 8), U(-8, 8)),
            (near_one(), U(-1000, 1000)),
            (log_uniform(1e-300, 1e300), U(-1, 1)),
            (U(0.5, 2), U(-1000, 1000)),
            (-U(0.1, 10), float(random.randint(-99, 99))),
        )
    )


def hyperbolic():
    return random.choice((U(-1, 1), U(-5, 5), U(-700, 700), signed(log_uniform(1e-20, 1))))


def real():
    return random.choice((U(-8, 8), signed(log_uniform(1e-320, 1e300))))


CASES = {
    "exp": (mp.exp, exponent),
    "ln": (mp.log, positive),
    "sin": (mp.sin, trig),
    "cos": (mp.cos, trig),
    "tan": (mp.tan, trig),
    "asin": (mp.asin, unit),
    "acos": (mp.acos, unit),
    "atan": (mp.atan, slope),
    "atan2": (mp.atan2, lambda: (slope(), slope())),
    "pow": (mp.power, power),
    "sinh": (mp.sinh, hyperbolic),
    "cosh": (mp.cosh, hyperbolic),
    "tanh": (mp.tanh, lambda: hyperbolic() / 30),
    "cbrt": (lambda x: mp.sign(x) * mp.cbrt(abs(x)), real),
}


def bits(x):
    return struct.pack(">d", x).hex()


if __name__ == "__main__":
    for name, (f, draw) in CASES.items():
        done = 0
        while done < 120:
            args = draw()
            args = args if isinstance(args, tuple) else (args,)
            exact = f(*map(mp.mpf, args))
            near = float(exact)
            if math.isinf(near):
                continue
            rest = (exact - mp.mpf(near)) / mp.mpf(math.ulp(near)) * 2**20
            y = args[1] if len(args) > 1 else 0.0
            print(name, bits(args[0]), bits(y), bits(near), int(mp.nint(rest)))
            done += 1
