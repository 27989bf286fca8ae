/* Encoders (see sim/encoders.py). */
#include "part.h"

enum { COUNTS, OFFSET, PERIOD, ERROR, BEFORE, LOST };
enum { NOISE, MISSED };

void exact_encoder(Part *p, int64_t k, const double *q, double *out) { memcpy(out, q, p->n * sizeof *q); }

void incremental_encoder(Part *p, int64_t k, const double *q, double *out) {
  int64_t n = p->n;
  for (int64_t j = 0; j < n; j++) {
    double counts = ROW(p, COUNTS)[j], period = ROW(p, PERIOD)[j], error = ROW(p, ERROR)[j], *before = ROW(p, BEFORE) + j;
    double x = (p->s[NOISE] ? q[j] + p->s[NOISE][k * n + j] : q[j]) * counts;
    if (error) x += period * error * sin(2 * PI / period * x);
    x = floor(x + ROW(p, OFFSET)[j]);
    if (p->s[MISSED]) {
      if (k) ROW(p, LOST)[j] += sign(x - *before) * p->s[MISSED][k * n + j];
      *before = x;
      x -= ROW(p, LOST)[j];
    }
    out[j] = x / counts;
  }
}
