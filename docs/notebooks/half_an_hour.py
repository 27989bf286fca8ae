"""
# The paper in half an hour

Simulate a robot, see what filters distort, compare the models, break the encoder, find the reversals. The cells take
at most half a minute. You know what a torque, a velocity and least squares are; the rest is here.

The robot is a SCARA of two joints with direct drives. Its motion follows from eight parameters X: two inertias (`ZZR1`,
`ZZ2`), two first moments (`LMX2`, `LMY2`), viscous and Coulomb friction of each joint (`Fv`, `Fs`).
"""

import numpy as np

import idbench

run = idbench.simulate("ideal", seed=1)
print(f"{run.log.samples} samples of {run.log.n} joints at {run.log.fs:g} Hz")
print({name: run.truth[name] for name in ("ZZR1", "Fv1", "Fs1", "ZZ2", "LMX2", "LMY2", "Fv2", "Fs2")})

"""
## 1. Identify

The torque is linear in the parameters, tau = D(q, qd, qdd) X. A log has positions and torques; velocities and accelerations
are differences of positions. Rows are filtered and decimated, and least squares gives X. Without noise, nothing is lost:
"""

robot = idbench.load_robot("scara")
fit = idbench.fit(run.log, robot, model="explicit")
for name in ("ZZR1", "Fv1", "LMY2"):
    found, true = fit.parameters[name], run.truth[name]
    print(f"{name}: {found.value:.6g} {found.unit}, true {true:g}")

"""
## 2. What filters distort

The paper filters q and tau at 8 Hz (`wfq`), and the rows at 4 Hz (`wfp`). Its differences take two samples: a velocity at
the frequency f is then too small by (2 pi f T)^2 / 6, T being the sampling period. Typical errors, without any noise:
"""

from dataclasses import replace

from idbench.identify import MODELS, ByChannel, ButterworthPrefilter, OrdinaryLeastSquares, identify_each, paper_chain, scara

truth = np.array([run.truth[name] for name in scara().names])
models = {name: MODELS.create(name) for name in ("explicit", "implicit", "power", "energy")}
print(f"{'prefilter':>10}" + "".join(f"{name:>12}" for name in models))
for cutoff in (2.0, 4.0, 8.0, 20.0):
    chain = replace(paper_chain(), prefilter=ButterworthPrefilter(cutoff), alignment=ByChannel())
    found = identify_each(run.log, scara(), models, chain, OrdinaryLeastSquares())
    worst = {name: np.exp(np.mean(np.log(e.relative_error_percent(list(truth))))) for name, e in found.items()}
    print(f"{cutoff:7g} Hz" + "".join(f"{x:10.2f} %" for x in worst.values()))

"""
Below ten times the bandwidth of the motion (8 Hz, the paper's rule) the filter takes away what the motion has. Above it the
difference of two samples is left. The energy model errs least: it takes h(tb) - h(ta), and differentiates no energy.

## 3. Which model?

Power multiplies the torques by the velocities and adds them: one row per instant, where the others have one for each joint.
To compare models with as many rows, the power model gets twice the logs. Ripple of the motors (cogging, commutation) is
what the paper had; white torque noise is what most others assume.
"""

table = idbench.study("models", seeds=3)
for noise in ("torque", "ripple"):
    for chain, estimator in (("idbench", "OLS"), ("idbench", "GLS")):
        errors = {
            cell.names[2]: cell.typical
            for cell in table.cells
            if cell.names[:2] == (chain, estimator) and cell.settings["noise"] == noise
        }
        print(f"{noise:7} {estimator}: power / explicit {errors['power'] / errors['explicit']:.2f}")

"""
With ripple and ordinary least squares power is better; with white noise it is worse, and so it is with generalized least
squares in chain `idbench`. [The conclusion](../conclusion.md) has it with intervals over 200 motions.

## 4. Break the encoder

An encoder of 12 bits counts 4096 steps a turn. Counts are differentiated twice. Weighted least squares
assumes independent noise; generalized least squares uses its covariance, which grows with the frequency.
"""

broken = idbench.simulate("quantization", seed=2)
for estimator in ("OLS", "WLS", "GLS"):
    found = idbench.fit(broken.log, robot, model="explicit", estimator=estimator)
    off = [abs(found.parameters[name].value / broken.truth[name] - 1) for name in scara().names]
    print(f"{estimator}: typical error {100 * np.exp(np.mean(np.log(off))):.3f} %")

"""
The recording of such a run shows it: the residual is not white, its spectrum rises towards the end of the band. This one has
a delay that the identification ignores, to see what a fault looks like:

<div class="recording" id="delay" data-recording="recordings/delay.rrd" markdown>

![Residuals with and without the delay](../recording-delay.png)

</div>

## 5. Find the reversals

Where a joint reverses, its Coulomb friction jumps from -Fs to Fs between two samples. A filter smears the jump of the
torque, and the differentiated position says "reversed" at another instant. The mask leaves out what lies near:
"""

from idbench.identify import NoMask, idbench_chain

masked, plain = idbench_chain(), replace(idbench_chain(), mask=NoMask())
for name, chain in (("masked", masked), ("not masked", plain)):
    found = identify_each(run.log, scara(), {"explicit": MODELS.create("explicit")}, chain, OrdinaryLeastSquares())["explicit"]
    errors = dict(zip(found.names, found.relative_error_percent(list(truth)), strict=True))
    print(f"{name:10}: Fs1 {errors['Fs1']:.2g} % off, Fv1 {errors['Fv1']:.2g} % off")

"""
Half of Table 1's errors of friction are made there: `idbench table1` takes each suspect out in turn.

<div class="recording" id="ripple" data-recording="recordings/ripple.rrd" markdown>

![Residuals over position: cogging](../recording-cogging.png)

</div>

## What to do next

`uv run idbench table1` and `table2` are the paper's tables, [your own log](../your-own-log.md) is the next page.
"""
