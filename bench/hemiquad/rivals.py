"""The integrands of `cargo run --release -p hemiquad --example rivals`, given to what a Python user would pick.

    python -m venv venv && venv/bin/pip install vegas scipy numpy cubature
    venv/bin/python bench/hemiquad/rivals.py

Same integrands, same budgets. Prints rows of the same table: relative RMSE (over 20 seeds for random methods) at 1024 and
16384 evaluations, and honesty: how often the error was within what was claimed (1.96 standard errors for random methods,
the claimed error for deterministic ones).
"""

import math

import numpy as np

SEEDS = 20
BUDGETS = (1024, 16384)


def disk(x, u, v, r):
    return (x[:, 0] - u) ** 2 + (x[:, 1] - v) ** 2 < r * r


def gauss(x, u, v, c):
    return np.exp(-c * c * ((x[:, 0] - u) ** 2 + (x[:, 1] - v) ** 2))


def erf_part(c, w):
    return math.sqrt(math.pi) / (2 * c) * (math.erf(c * (1 - w)) + math.erf(c * w))


R = math.sqrt(1e-3 / math.pi)
PROBLEMS = {
    "gaussian": (lambda x: np.exp(-81 * (x[:, 0] - 0.3) ** 2 - 25 * (x[:, 1] - 0.6) ** 2), erf_part(9, 0.3) * erf_part(5, 0.6)),
    "discontinuous": (
        lambda x: np.where((x[:, 0] <= 0.3) & (x[:, 1] <= 0.6), np.exp(3 * x[:, 0] + 2 * x[:, 1]), 0.0),
        (math.exp(0.9) - 1) / 3 * (math.exp(1.2) - 1) / 2,
    ),
    "kinked maximum": (
        lambda x: np.maximum(np.maximum(x[:, 0], x[:, 1]), (1 - x[:, 0]) * (1 - x[:, 1])),
        0.7287375324796,
    ),
    "disk": (lambda x: disk(x, 0.43, 0.56, 0.31).astype(float), math.pi * 0.31**2),
    "aliased sine": (lambda x: np.sin(2 * np.pi * 32 * x[:, 0]) ** 2, 0.5),
    "two spots on a diagonal": (
        lambda x: gauss(x, 0.23, 0.23, 30) + gauss(x, 0.74, 0.74, 30),
        erf_part(30, 0.23) ** 2 + erf_part(30, 0.74) ** 2,
    ),
    "pixel 1e-3": (lambda x: np.where(disk(x, 0.43, 0.58, R), 1e3, 0.5), 0.5 * (1 - 1e-3) + 1.0),
    "two patches": (
        lambda x: (0.6 * disk(x, 0.213, 0.377, 0.01) + 0.4 * disk(x, 0.718, 0.641, 0.01)) / (math.pi * 1e-4),
        1.0,
    ),
}


def run_vegas(f, n, seed):
    import gvar
    import vegas

    # vegas draws from gvar's generator, not from NumPy's.
    gvar.ranseed(seed)
    integrator = vegas.Integrator([[0, 1], [0, 1]])
    batch = vegas.lbatchintegrand(f)
    # Half of the budget adapts and is thrown away, as its documentation advises.
    passes = 5
    integrator(batch, nitn=passes, neval=n / 2 / passes)
    r = integrator(batch, nitn=passes, neval=n / 2 / passes)
    return r.mean, 1.96 * r.sdev


def run_scipy(f, n, _):
    from scipy.integrate import cubature

    # The rule (Genz–Malik) takes 17 points per region; every subdivision makes two new regions.
    r = cubature(f, [0, 0], [1, 1], rule="genz-malik", rtol=1e-12, atol=0, max_subdivisions=max((n - 17) // 34, 1))
    return float(r.estimate), float(r.error)


def run_hcubature(f, n, _):
    from cubature import cubature

    def g(x, *_):
        return f(np.asarray(x).reshape(-1, 2))

    value, error = cubature(g, 2, 1, [0, 0], [1, 1], relerr=1e-12, abserr=0, maxEval=n, vectorized=True)
    return float(value[0]), float(error[0])


def run_qmc(f, n, seed):
    from scipy.stats import qmc

    means = [f(qmc.Sobol(2, rng=seed * 8 + k).random(n // 8)).mean() for k in range(8)]
    return float(np.mean(means)), 2.365 * float(np.std(means, ddof=1)) / math.sqrt(8)


RIVALS = {
    "vegas 6": (run_vegas, SEEDS),
    "scipy cubature (Genz–Malik)": (run_scipy, 1),
    "cubature (hcubature)": (run_hcubature, 1),
    "scipy qmc.Sobol, 8 scrambles": (run_qmc, SEEDS),
}


def main():
    print("| integrand | method | RMSE 1024 | honest | RMSE 16384 | honest |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, (f, exact) in PROBLEMS.items():
        for rival, (run, seeds) in RIVALS.items():
            cells = []
            for n in BUDGETS:
                try:
                    results = [run(f, n, seed) for seed in range(seeds)]
                except Exception as problem:  # noqa: BLE001 (a rival that refuses is a result)
                    cells.append(f"{type(problem).__name__} | –")
                    continue
                errors = [abs(v - exact) for v, _ in results]
                rmse = math.sqrt(sum(e * e for e in errors) / seeds) / exact
                # Rounding is allowed for.
                honest = sum(e <= c + 1e-13 * abs(exact) for e, (_, c) in zip(errors, results)) / seeds
                cells.append(f"{rmse:.1e} | {100 * honest:.0f} %")
            print(f"| {name} | {rival} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
