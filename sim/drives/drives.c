/* Drives (see sim/drives). The torque constant K is their first row; traces have a row of every joint for each signal. */
#include "../part.h"

enum { K };

int64_t ideal_drive(Part *p, int64_t rows, int64_t steps, const double *demand, const double *q, const double *speed, double *tau,
                    double *trace) {
  memcpy(tau, demand, p->n * sizeof *tau);
  return 1;
}

int64_t averaged_drive(Part *p, int64_t rows, int64_t steps, const double *demand, const double *q, const double *speed, double *tau,
                       double *trace) {
  enum { R = K + 1, L_, V_, I_, W, CURRENT };
  int64_t n = p->n;
  double dt = steps * p->h;
  for (int64_t j = 0; j < n; j++) {
    double k = ROW(p, K)[j], r = ROW(p, R)[j], L = ROW(p, L_)[j], V = ROW(p, V_)[j], w = ROW(p, W)[j], *i = ROW(p, CURRENT) + j;
    double e = k * speed[rows / 2 * n + j], i0 = *i, i1 = i0, charge = 0, t = 0, limited = within(demand[j] / k, ROW(p, I_)[j]);
    double target = lower(higher(limited, (-V - e) / r), (V - e) / r), asked = r * i0 + L * w * (target - i0) + e;
    int saturated = fabs(asked) > V;
    if (saturated) { /* L di/dt = v - R i - e with v at its limit, for the time t, then i follows the loop */
      double v = copysign(V, asked), end = (v - e) / r, released = (v - e - L * w * target) / (r - L * w);
      t = lower(-log(lower(higher((released - end) / (i0 == end ? 1 : i0 - end), 1e-300), 1)) * L / r, dt);
      i1 = end + (i0 - end) * exp(-t * r / L);
      charge = end * t - (i1 - i0) * L / r;
    }
    double away = i1 - target, rest = dt - t, current = (charge + target * rest - away * (expm1(-w * rest) / w)) / dt;
    *i = target + away * exp(-w * rest);
    tau[j] = k * current;
    if (trace) {
      double done[] = {demand[j], limited, current, i0, *i, e, saturated};
      for (int64_t s = 0; s < 7; s++) trace[s * n + j] = done[s];
    }
  }
  return 1;
}

/* What a period does at each value of the modulation index, see PeriodTable. */
typedef struct {
  double *linear, *pieces;
  int64_t values, quantities, count;
} Table;

/* A period in which the current may change its sign: its charge [A s]; the pieces are `stride` numbers apart. */
static double careful(double *i, const double *piece, int64_t count, int64_t stride, double e, double V, double R, double L) {
  double total = 0, share = L / R, rate = R / L;
  for (int64_t k = 0; k < count; k++, piece += stride) {
    double dt = piece[0], ahead = (piece[1] * V - e) / R, behind = (piece[2] * V - e) / R;
    double goal = ahead == behind || *i > 0 ? ahead : behind, end = goal + (*i - goal) * piece[3];
    if (ahead != behind && *i * end <= 0) { /* at zero it stays, unless e drives it on */
      double onward = fmax(ahead, 0) + fmin(behind, 0), until = goal != 0 && *i != 0 ? log(1 - *i / goal) / rate : 0;
      double rest = dt - fmin(until, dt);
      end = -onward * expm1(-rest * rate);
      total += goal * (dt - rest) + *i * share;
      *i = 0;
      goal = onward;
      dt = rest;
    }
    total += goal * dt + (*i - end) * share;
    *i = end;
  }
  return total;
}

int64_t switched_drive(Part *p, int64_t rows, int64_t steps, const double *demand, const double *q, const double *speed, double *tau,
                       double *trace) {
  enum { V = K + 1, R, L, I, KP, KI, MOST, KNOWN, LEAST, HIGHEST, DEAD, CURRENT, SUM };
  const Table *table = (const Table *)p->o;
  int64_t n = p->n, size = table->quantities;
  for (int64_t j = 0; j < n; j++) {
    double k = ROW(p, K)[j], wanted = within(demand[j] / k, ROW(p, I)[j]), *i = ROW(p, CURRENT) + j, *sum = ROW(p, SUM) + j;
    for (int64_t row = 0; row < rows; row++) {
      /* v = kp (i_ref - i) + sum + known e within its limit; the integrator rests while v is at it. */
      double e = k * speed[row * n + j], before = *i, error = wanted - before, charge = NAN;
      double asked = ROW(p, KP)[j] * error + *sum + ROW(p, KNOWN)[j] * e, v = within(asked, ROW(p, MOST)[j]);
      if (v == asked) *sum += ROW(p, KI)[j] * error;
      double index = rint(v / ROW(p, V)[j] / ROW(p, LEAST)[j]);
      if (isfinite(asked) && isfinite(e)) {
        int64_t value = (int64_t)index + (int64_t)ROW(p, HIGHEST)[j], turns = 0;
        const double *f = table->linear + (((before > 0) * table->values + value) * n + j) * 3 * size;
        double now = 0;
        for (int64_t edge = 1; edge < size && !turns; edge++) { /* constant + by_i i + by_e e, while i keeps its sign */
          now = f[edge] + f[size + edge] * before + f[2 * size + edge] * e;
          turns = ROW(p, DEAD)[j] && now * before <= 0;
        }
        charge = f[0] + f[size] * before + f[2 * size] * e;
        const double *pieces = table->pieces + (value * table->count * n + j) * 4;
        if (turns) charge = careful(i, pieces, table->count, n * 4, e, ROW(p, V)[j], ROW(p, R)[j], ROW(p, L)[j]);
        else *i = now;
      } else *i = NAN; /* the simulation then fails, and says so */
      tau[row * n + j] = charge * (k / p->h);
      if (trace) {
        double done[] = {wanted, charge, before, *i, e, index * ROW(p, LEAST)[j]};
        for (int64_t s = 0; s < 6; s++) trace[(row * 6 + s) * n + j] = done[s];
      }
    }
  }
  return rows;
}

/* Fastest speed at the end of a step that still stops, with v h / 2 + v^2 / 2a of the way left. */
static double accelerated(double way, double speed, double rate, double a, double h) {
  double left = higher(fabs(way) - sign(way) * speed * h / 2, 0), half = a * h / 2;
  double fastest = sqrt(2 * a * left + half * half) - half;
  return lower(higher(sign(way) * lower(fastest, rate), speed - a * h), speed + a * h);
}

/* Mean over a step of a target that follows a command within a rate and an acceleration; it begins at the first command. */
static double followed(double *target, double *speed, double command, double rate, double a, double h) {
  if (isnan(*target)) *target = command;
  double before = *target, way = command - before;
  if (isfinite(a)) {
    double after = accelerated(way, *speed, rate, a, h);
    *target = before + (*speed + after) / 2 * h;
    *speed = after;
    return (before + *target) / 2;
  }
  double move = within(way, rate * h);
  *target = before + move;
  return *target - move * fabs(move) / (2 * rate * h); /* a command that is reached counts for the rest of the step */
}

int64_t servo_drive(Part *p, int64_t rows, int64_t steps, const double *demand, const double *q, const double *speed, double *tau,
                    double *trace) {
  enum { R = K + 1, GAIN, MOST, RATE, ACCELERATION, LEAD, DEAD_BAND, DUTY, SUPPLY, COUNT, SHORTED, OFF, TARGET, SPEED, T };
  int64_t n = p->n;
  for (int64_t j = 0; j < n; j++) {
    double k = ROW(p, K)[j], r = ROW(p, R)[j], gain = ROW(p, GAIN)[j], most = ROW(p, MOST)[j], count = ROW(p, COUNT)[j];
    double dead = ROW(p, DEAD_BAND)[j], limit = ROW(p, DUTY)[j], *t = ROW(p, T) + j;
    for (int64_t row = 0; row < steps; row++, *t += p->h) {
      int64_t at = row % rows;
      double target = followed(ROW(p, TARGET) + j, ROW(p, SPEED) + j, demand[j], ROW(p, RATE)[j], ROW(p, ACCELERATION)[j], p->h);
      double on = 1, qd = speed[at * n + j], seen = q[at * n + j], emf = k * qd;
      for (int64_t off = 0; off < ROW(p, OFF)[j]; off++) if (p->s[0][2 * off] <= *t && *t < p->s[0][2 * off + 1]) on = 0;
      if (count) seen = rint(seen / count) * count;
      double error = target - seen - ROW(p, LEAD)[j] * qd;
      if (dead) error -= within(error, dead);
      double asked = gain * error * on, duty = within(asked, limit);
      double wanted = (on || ROW(p, SHORTED)[j]) * (ROW(p, SUPPLY)[j] * duty - emf) / r, current = within(wanted, most);
      tau[row * n + j] = k * current;
      if (trace) {
        double done[] = {duty, current, emf, fabs(asked) > limit || fabs(wanted) > most, r * current + emf};
        for (int64_t s = 0; s < 5; s++) trace[(row * 5 + s) * n + j] = done[s];
      }
    }
  }
  return steps;
}
