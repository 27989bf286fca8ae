/* Frictions (see sim/frictions). Those that MuJoCo's own Coulomb friction makes, set anew in every step, add no torque. */
#include "../part.h"

enum { LOSS, PASSIVE, CONSTRAINT };
#define LOSS_OF(p, j) ((double *)(p)->o[LOSS])[(j) * (p)->stride]

void coulomb(Part *p, const double *tau, const double *qd, double *out) { memset(out, 0, p->n * sizeof *out); }

void stribeck(Part *p, const double *tau, const double *qd, double *out) {
  enum { FS, RISE, VELOCITY, SLOW };
  coulomb(p, tau, qd, out);
  for (int64_t j = 0; j < p->n; j++) {
    double u = (qd[j] == 0 ? ROW(p, SLOW)[j] : fabs(qd[j])) / ROW(p, VELOCITY)[j];
    LOSS_OF(p, j) = higher(ROW(p, FS)[j] + ROW(p, RISE)[j] * exp(-(u * u)), 0);
  }
}

void load_dependent(Part *p, const double *tau, const double *qd, double *out) {
  enum { FS, SHARE };
  coulomb(p, tau, qd, out);
  for (int64_t j = 0; j < p->n; j++) {
    double load = tau[j] + ((double *)p->o[PASSIVE])[j * p->stride] + ((double *)p->o[CONSTRAINT])[j * p->stride];
    LOSS_OF(p, j) = ROW(p, FS)[j] + ROW(p, SHARE)[j] * fabs(load);
  }
}

void asymmetric(Part *p, const double *tau, const double *qd, double *out) {
  enum { OFFSET, DIFFERENCE, EDGE };
  for (int64_t j = 0; j < p->n; j++) {
    double speed = fabs(qd[j]);
    out[j] = -ROW(p, OFFSET)[j] * tanh(speed / ROW(p, EDGE)[j]) - ROW(p, DIFFERENCE)[j] * speed;
  }
}

void warming(Part *p, const double *tau, const double *qd, double *out) {
  enum { SLOPE, REFERENCE, COLD, WARM, TIME, STEPS };
  for (int64_t j = 0; j < p->n; j++) {
    double t = (ROW(p, STEPS)[j]++ + 0.5) * p->h, warm = ROW(p, WARM)[j];
    double above = warm + (ROW(p, COLD)[j] - warm) * exp(-t / ROW(p, TIME)[j]) - ROW(p, REFERENCE)[j];
    out[j] = -ROW(p, SLOPE)[j] * above * qd[j];
  }
}

void lugre(Part *p, const double *tau, const double *qd, double *out) {
  enum { FS, DEFLECTION, STATIC, VELOCITY, DAMPING, Z };
  for (int64_t j = 0; j < p->n; j++) {
    double *z = ROW(p, Z) + j, z0 = *z, deflection = ROW(p, DEFLECTION)[j], v = qd[j] / ROW(p, VELOCITY)[j], fading = exp(-(v * v));
    double g = 1 + (ROW(p, STATIC)[j] - 1) * fading, x = fabs(qd[j] / deflection) * p->h / g, limit = sign(qd[j]) * g;
    *z = limit + (z0 - limit) * exp(-x);
    double mean = x > 0 ? limit + (z0 - limit) * -expm1(-x) / x : z0;
    /* The damping fades with speed, as it must for the friction to stay passive. */
    out[j] = -(ROW(p, FS)[j] * mean + ROW(p, DAMPING)[j] * deflection * fading * (*z - z0) / p->h);
  }
}
