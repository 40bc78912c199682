"""Polynomial coefficients and split constants of `isoswarm_field::math`, printed as Rust.

Each polynomial interpolates its function in Chebyshev nodes at 60 digits, which is within a small factor of the
minimax polynomial, and is then rounded to double precision. Needs only mpmath.

    python3 math_coefficients.py
"""

import mpmath as mp

mp.mp.dps = 60


def fit(f, lo, hi, n):
    """The n coefficients of the interpolant of f on [lo, hi], and its largest relative error after rounding."""
    lo, hi = mp.mpf(lo), mp.mpf(hi)
    nodes = [(lo + hi) / 2 + (hi - lo) / 2 * mp.cos(mp.pi * (2 * i + 1) / (2 * n)) for i in range(n)]
    v = mp.matrix(n, n)
    for i, x in enumerate(nodes):
        for j in range(n):
            v[i, j] = x**j
    c = mp.lu_solve(v, mp.matrix([f(x) for x in nodes]))
    c = [mp.mpf(float(x)) for x in c]
    worst = mp.mpf(0)
    for i in range(401):
        x = lo + (hi - lo) * i / 400
        if x == 0:
            continue
        worst = max(worst, abs(mp.polyval(c[::-1], x) / f(x) - 1))
    return [float(x) for x in c], worst


def split(value, *bits):
    """Parts of `value`: each but the last holds the given number of leading bits."""
    parts, rest = [], mp.mpf(value)
    for b in bits:
        e = mp.floor(mp.log(abs(rest), 2)) - (b - 1)
        part = mp.floor(rest / mp.mpf(2) ** e) * mp.mpf(2) ** e
        parts.append(float(part))
        rest -= part
    parts.append(float(rest))
    return parts


def odd_rest(f):
    """Z -> (f(t) - t) / t^3 with z = t^2."""
    return lambda z: (f(mp.sqrt(z)) - mp.sqrt(z)) / mp.sqrt(z) ** 3


HALF_LN2 = mp.log(2) / 2 * mp.mpf("1.001")
S2 = ((mp.sqrt(2) - 1) / (mp.sqrt(2) + 1)) ** 2 * mp.mpf("1.001")
FITS = {
    "EXP_POLY": (lambda r: (mp.exp(r) - 1 - r) / r**2, -HALF_LN2, HALF_LN2, 10),
    "LN_POLY": (lambda z: (2 * mp.atanh(mp.sqrt(z)) / mp.sqrt(z) - 2) / z, 0, S2, 7),
    "LN_DD_POLY": (lambda z: (2 * mp.atanh(mp.sqrt(z)) / mp.sqrt(z) - 2 - 2 * z / 3) / z**2, 0, S2, 8),
    "SIN_POLY": (odd_rest(mp.sin), 0, "0.64", 6),
    "COS_POLY": (lambda z: (mp.cos(mp.sqrt(z)) - 1 + z / 2) / z**2, 0, "0.64", 6),
    "ATAN_POLY": (odd_rest(mp.atan), 0, (mp.mpf(7) / 16) ** 2, 11),
    "ASIN_POLY": (odd_rest(mp.asin), 0, "0.25", 13),
    "CBRT_POLY": (mp.cbrt, "0.5", "4", 5),
}
SPLITS = {
    "LN2": (mp.log(2), 32),
    "LN2_42": (mp.log(2), 42),
    "PIO2": (mp.pi / 2, 33, 33, 33),
    "PI_HALF": (mp.pi / 2, 53),
    "PI": (mp.pi, 53),
    "PI_4": (mp.pi / 4, 53),
    "ATAN_HALF": (mp.atan(mp.mpf(1) / 2), 53),
    "TWO_THIRDS": (mp.mpf(2) / 3, 53),
}

if __name__ == "__main__":
    for name, (f, lo, hi, n) in FITS.items():
        c, err = fit(f, lo, hi, n)
        print(f"// relative error 2^{float(mp.log(err, 2)):.1f}\nconst {name}: [f64; {n}] = {c!r};")
    for name, (value, *bits) in SPLITS.items():
        print(f"const {name}: [f64; {len(bits) + 1}] = {split(value, *bits)!r};")
    print("LOG2_E", float(1 / mp.log(2)), "TWO_OVER_PI", float(2 / mp.pi))
