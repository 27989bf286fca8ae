/* Controllers (see sim/controllers.py). */
#include "part.h"

enum { KP, KD, SHARE, FS, E, RATE, KI, HOLD, SUM, FACTOR = KI };
enum { Q, FEEDFORWARD, QD = FEEDFORWARD, QDD };

/* Control error, and its difference quotient behind a low-pass. */
static void error(Part *p, int64_t k, const double *q) {
  double *e = ROW(p, E), *rate = ROW(p, RATE);
  for (int64_t j = 0; j < p->n; j++) {
    double x = p->s[Q][k * p->n + j] - q[j];
    if (k) rate[j] += ROW(p, SHARE)[j] * ((x - e[j]) * ROW(p, FS)[j] - rate[j]);
    e[j] = x;
  }
}

static double pd(Part *p, double ahead, int64_t j) { return ahead + ROW(p, KP)[j] * ROW(p, E)[j] + ROW(p, KD)[j] * ROW(p, RATE)[j]; }

void pd_feedforward(Part *p, int64_t k, const double *q, double *out) {
  error(p, k, q);
  for (int64_t j = 0; j < p->n; j++) out[j] = pd(p, p->s[FEEDFORWARD][k * p->n + j], j);
}

void pid(Part *p, int64_t k, const double *q, double *out) {
  error(p, k, q);
  for (int64_t j = 0; j < p->n; j++) out[j] = pd(p, ROW(p, HOLD)[j], j) + ROW(p, KI)[j] * (ROW(p, SUM)[j] += ROW(p, E)[j]);
}

/* The nominal robot in MuJoCo: functions, structures and arrays, M's lower triangle in rows. */
typedef struct {
  void (*position)(void *, void *), (*velocity)(void *, void *);
  void *model, *data;
  double *q, *qd, *M, *bias, *passive;
  int32_t *count, *column;
} Nominal;

void computed_torque(Part *p, int64_t k, const double *q, double *out) {
  const Nominal *r = (const Nominal *)p->o;
  int64_t n = p->n;
  double qdd[n], A[n][n];
  error(p, k, q);
  for (int64_t j = 0; j < n; j++) {
    r->q[j] = q[j];
    r->qd[j] = p->s[QD][k * n + j] - ROW(p, RATE)[j];
    qdd[j] = pd(p, p->s[QDD][k * n + j], j);
  }
  r->position(r->model, r->data);
  r->velocity(r->model, r->data);
  memset(A, 0, sizeof A);
  for (int64_t i = 0, at = 0; i < n; i++)
    for (int64_t x = 0; x < r->count[i]; x++, at++) A[i][r->column[at]] = A[r->column[at]][i] = r->M[at];
  for (int64_t i = 0; i < n; i++) {
    double total = 0;
    for (int64_t j = 0; j < n; j++) total += A[i][j] * qdd[j];
    out[i] = ROW(p, FACTOR)[i] * (total + r->bias[i] - r->passive[i]);
  }
}

void position_command(Part *p, int64_t k, const double *q, double *out) { memcpy(out, p->s[Q] + k * p->n, p->n * sizeof *q); }
