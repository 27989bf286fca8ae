/* The closed loop of one simulation around mj_step, from a sample to another (see sim/engine/bench.py).

   Where a part is in Python the loop returns, and goes on from there when it is called again. No header of MuJoCo: its functions
   and arrays come as pointers, so that one binary serves any MuJoCo 4. */
#include <setjmp.h>

#include "../part.h"

enum { DONE, READ, COMMAND, DRIVE, RESIST };          /* why it returns: done, or a part is Python's */
enum { RUNNING, OUT_OF_BOUNDS, NOT_FINITE, STOPPED }; /* how a simulation is; what cannot go on is told in Python */
enum { STEP, PLACE, SAMPLE, STEPS, ROWS, TORQUES, STATE, TRACED, BEFORE_STEPS }; /* whole numbers that it remembers */
enum { BEFORE, COMMANDED, DEMAND, SPEED, SENSED, THEN, MEASURED, RESISTANCE }; /* remembered of each joint */
enum { MIDDLE_Q, MIDDLE_QD, SEEN, CONSTANT, TURNING, ELECTRIC, TAU, TOTAL };   /* of each joint in each step to come */
enum { OUT_MEASURED, OUT_COMMAND, OUT_CURRENT, OUT_Q, OUT_QD, OUT_TAU, OUT_GAP };
enum { WARNINGS = 7 }; /* kinds of MuJoCo 4 */

typedef struct { /* sum over k of amplitude * harmonics[k] * sin((k + 1) (order q + phase)) */
  double *amplitude, *order, *phase, *harmonics;
  int64_t count;
} Series;

typedef struct { /* the robot of a simulation in MuJoCo, and where a loop at work keeps it */
  void (*step)(void *, void *);
  void *model, *data;
  double *qpos, *qvel, *applied;
  int32_t *warned;
  int64_t n, stride;
  double *middle, *half, *fastest;
  int64_t *N;
  char *complaint; /* of MuJoCo, 1024 characters */
} Body;

typedef struct {
  Body body;
  int64_t samples, per_sample, late, most, steady, smooth, sees_rotor, signals, ring;
  double old, h, filter;
  Part *encoder, *law, *drive, *friction;
  Series cogging, commutation;
  double *offsets, *q_ring, *qd_ring, *now, *rows, *records, *drawn, *trace;
} Loop;

#define NOW(l, row) ((l)->now + (row) * (l)->body.n)
#define ROWS_OF(l, row) ((l)->rows + (row) * (l)->most * (l)->body.n)
#define RECORD(l, channel, k) ((l)->records + ((channel) * (l)->samples + (k)) * (l)->body.n)

static double ripple(const Series *s, double q, int64_t j) {
  double angle = s->order[j] * q + s->phase[j], total = s->harmonics[0] * sin(angle);
  for (int64_t k = 1; k < s->count; k++) total += s->harmonics[k] * sin((k + 1) * angle);
  return s->amplitude[j] * total;
}

/* Of a robot with play, two hinges a joint: the rotor behind the gear, and the link relative to it. */
static double of_rotor(const Body *b, const double *x, int64_t j) { return x[j * b->stride]; }
static double of_link(const Body *b, const double *x, int64_t j) { return b->stride == 1 ? x[j] : x[2 * j] + x[2 * j + 1]; }

static int in_bounds(const Body *b) {
  for (int64_t w = 0; w < WARNINGS; w++) if (b->warned[2 * w]) return 0;
  for (int64_t j = 0; j < b->n; j++)
    if (!(fabs(of_link(b, b->qpos, j) - b->middle[j]) <= b->half[j] && fabs(of_link(b, b->qvel, j)) <= b->fastest[j])) return 0;
  return 1;
}

/* Position at an instant, in steps, by the cubic that has the positions and velocities of the steps about it. */
static double between(const Loop *l, double x, int64_t last, int64_t j) {
  x = fmax(x, 0);
  int64_t n = l->body.n, before = (int64_t)floor(x), after;
  before = before < last ? before : last;
  after = before < last ? before + 1 : last;
  double s = x - before, *q = l->q_ring, *qd = l->qd_ring;
  int64_t a = before % l->ring * n + j, b = after % l->ring * n + j;
  double v0 = qd[a] * l->h, v1 = qd[b] * l->h, rise = q[b] - q[a];
  return q[a] + s * (v0 + s * ((3 * rise - 2 * v0 - v1) + s * (v0 + v1 - 2 * rise)));
}

/* Record a sample; see whether a command begins to act, and what the encoder then reads. */
static void begin(Loop *l) {
  const Body *b = &l->body;
  int64_t n = l->body.n, step = l->body.N[STEP], k = step / l->per_sample, since = step - l->late, at = step % l->ring * n;
  if (step % l->per_sample == 0) {
    if (!in_bounds(b)) {
      l->body.N[STATE] = OUT_OF_BOUNDS;
      return;
    }
    for (int64_t j = 0; k < l->samples && j < n; j++) {
      RECORD(l, OUT_Q, k)[j] = of_link(b, b->qpos, j);
      RECORD(l, OUT_QD, k)[j] = of_link(b, b->qvel, j);
      RECORD(l, OUT_CURRENT, k)[j] = NOW(l, SENSED)[j];
      RECORD(l, OUT_GAP, k)[j] = of_rotor(b, b->qpos, j) - of_link(b, b->qpos, j);
    }
  }
  for (int64_t j = 0; j < n; j++) {
    l->q_ring[at + j] = l->sees_rotor ? of_rotor(b, b->qpos, j) : of_link(b, b->qpos, j);
    l->qd_ring[at + j] = l->sees_rotor ? of_rotor(b, b->qvel, j) : of_link(b, b->qvel, j);
  }
  l->body.N[SAMPLE] = since >= 0 && since % l->per_sample == 0 ? since / l->per_sample : -1;
  if (l->body.N[SAMPLE] >= 0)
    for (int64_t j = 0; j < n; j++)
      NOW(l, THEN)[j] = l->offsets ? between(l, since + l->offsets[l->body.N[SAMPLE]], step, j) : l->q_ring[since % l->ring * n + j];
}

/* Let a new command act: together with the one before where it begins within a step. */
static void obey(Loop *l) {
  for (int64_t j = 0; j < l->body.n; j++) {
    double command = NOW(l, COMMANDED)[j];
    RECORD(l, OUT_MEASURED, l->body.N[SAMPLE])[j] = NOW(l, MEASURED)[j];
    RECORD(l, OUT_COMMAND, l->body.N[SAMPLE])[j] = command;
    NOW(l, DEMAND)[j] = l->old == 0 ? command : l->old * NOW(l, BEFORE)[j] + (1 - l->old) * command;
  }
}

/* For how many steps nothing changes, and where the joints will be in the middle of each, accelerating as before. */
static void look_ahead(Loop *l) {
  const Body *b = &l->body;
  int64_t n = l->body.n, step = l->body.N[STEP], per = l->per_sample, after = ((step - l->late) % per + per) % per, steps = per - after;
  if (after == 1) memcpy(NOW(l, DEMAND), NOW(l, COMMANDED), n * sizeof(double));
  if (per - step % per < steps) steps = per - step % per;
  if (l->most < steps) steps = l->most;
  if (after == 0 && (l->steady || l->old > 0)) steps = 1; /* a new current settles in a step of its own, as does a mixture */
  int64_t rows = l->steady ? 1 : steps;
  double length = (double)(steps / rows) * l->h;
  for (int64_t j = 0; j < n; j++) {
    double q = of_rotor(b, b->qpos, j), qd = of_rotor(b, b->qvel, j), rate = (qd - NOW(l, SPEED)[j]) / (l->body.N[BEFORE_STEPS] * l->h);
    double q_apart = of_link(b, b->qpos, j) - q, qd_apart = of_link(b, b->qvel, j) - qd;
    NOW(l, SPEED)[j] = qd;
    for (int64_t r = 0; r < rows; r++) {
      double t = (r + 0.5) * length, mid_qd = qd + rate * t, mid_q = q + qd * t + rate * (t * t / 2);
      double constant = l->smooth ? 1 : 1 + ripple(&l->commutation, mid_q, j);
      ROWS_OF(l, MIDDLE_Q)[r * n + j] = mid_q;
      ROWS_OF(l, MIDDLE_QD)[r * n + j] = mid_qd;
      ROWS_OF(l, SEEN)[r * n + j] = b->stride == 2 && !l->sees_rotor ? mid_q + q_apart + qd_apart * t : mid_q;
      ROWS_OF(l, CONSTANT)[r * n + j] = constant;
      ROWS_OF(l, TURNING)[r * n + j] = mid_qd * constant;
    }
  }
  l->body.N[STEPS] = l->body.N[BEFORE_STEPS] = steps;
  l->body.N[ROWS] = rows;
}

/* Torques of the motors, ripple included, and the current that a sensor sees behind its filter. */
static void ripple_torques(Loop *l) {
  int64_t n = l->body.n, given = l->body.N[TORQUES], rows = l->smooth || given > l->body.N[ROWS] ? given : l->body.N[ROWS];
  double part = l->body.N[STEPS] * l->h / given;
  for (int64_t r = 0; r < given; r++)
    for (int64_t j = 0; j < n; j++) {
      double electric = ROWS_OF(l, ELECTRIC)[r * n + j], *sensed = NOW(l, SENSED) + j;
      *sensed = isinf(l->filter) ? electric : electric - (electric - *sensed) * exp(-l->filter * part);
    }
  for (int64_t r = 0; r < rows; r++)
    for (int64_t j = 0; j < n; j++) {
      double electric = ROWS_OF(l, ELECTRIC)[(given == 1 ? 0 : r) * n + j];
      int64_t at = (l->body.N[ROWS] == 1 ? 0 : r) * n + j;
      ROWS_OF(l, TAU)[r * n + j] =
          l->smooth ? electric : electric * ROWS_OF(l, CONSTANT)[at] + ripple(&l->cogging, ROWS_OF(l, MIDDLE_Q)[at], j);
    }
  l->body.N[ROWS] = rows;
}

/* Rows of start and length [steps], length of the rows of the drive's own signals, torques, signals: of the watched alone. */
static void trace(Loop *l) {
  int64_t n = l->body.n, rows = l->body.N[ROWS], size = 3 + (1 + l->signals) * n;
  for (int64_t r = 0; r < rows; r++) {
    double *row = l->trace + l->body.N[TRACED]++ * size;
    row[0] = l->body.N[STEP] + r * (l->body.N[STEPS] / rows);
    row[1] = l->body.N[STEPS] / rows;
    row[2] = (double)l->body.N[STEPS] / l->body.N[TORQUES];
    memcpy(row + 3, ROWS_OF(l, TAU) + r * n, n * sizeof *row);
    memcpy(row + 3 + n, l->drawn + (l->body.N[TORQUES] == 1 ? 0 : r) * l->signals * n, l->signals * n * sizeof *row);
  }
}

/* Take the steps. */
static void go(Loop *l) {
  int64_t n = l->body.n, rows = l->body.N[ROWS], k = l->body.N[STEP] / l->per_sample;
  double *total = ROWS_OF(l, TOTAL), *tau = ROWS_OF(l, TAU);
  for (int64_t x = 0; x < rows * n; x++)
    if (!isfinite(total[x] = tau[x] + NOW(l, RESISTANCE)[x % n])) l->body.N[STATE] = NOT_FINITE;
  if (l->body.N[STATE]) return;
  if (l->trace) trace(l);
  for (int64_t s = 0; s < l->body.N[STEPS]; s++) {
    for (int64_t j = 0; j < n && s < rows; j++) l->body.applied[j * l->body.stride] = total[s * n + j];
    l->body.step(l->body.model, l->body.data);
  }
  for (int64_t j = 0; j < n && k < l->samples; j++) {
    double sum = 0;
    for (int64_t r = 0; r < rows; r++) sum += tau[r * n + j];
    RECORD(l, OUT_TAU, k)[j] += sum / rows * l->body.N[STEPS];
  }
  l->body.N[STEP] += l->body.N[STEPS];
}

static int64_t advance(Body *b, int64_t until) {
  Loop *l = (Loop *)b;
  switch (l->body.N[PLACE]) {
    case READ: goto was_read;
    case COMMAND: goto was_commanded;
    case DRIVE: goto was_driven;
    case RESIST: goto was_resisted;
  }
  while (l->body.N[STEP] < until) {
    begin(l);
    if (l->body.N[STATE]) break;
    if (l->body.N[SAMPLE] >= 0) {
      if (!l->encoder->run) return l->body.N[PLACE] = READ;
      ((Sampled *)l->encoder->run)(l->encoder, l->body.N[SAMPLE], NOW(l, THEN), NOW(l, MEASURED));
    was_read:
      memcpy(NOW(l, BEFORE), NOW(l, COMMANDED), l->body.n * sizeof(double));
      if (!l->law->run) return l->body.N[PLACE] = COMMAND;
      ((Sampled *)l->law->run)(l->law, l->body.N[SAMPLE], NOW(l, MEASURED), NOW(l, COMMANDED));
    was_commanded:
      obey(l);
    }
    look_ahead(l);
    if (!l->drive->run) return l->body.N[PLACE] = DRIVE;
    l->body.N[TORQUES] = ((Driving *)l->drive->run)(l->drive, l->body.N[ROWS], l->body.N[STEPS], NOW(l, DEMAND), ROWS_OF(l, SEEN),
                                               ROWS_OF(l, TURNING), ROWS_OF(l, ELECTRIC), l->trace ? l->drawn : 0);
  was_driven:
    ripple_torques(l);
    if (!l->friction->run) return l->body.N[PLACE] = RESIST;
    ((Resisting *)l->friction->run)(l->friction, ROWS_OF(l, TAU), ROWS_OF(l, MIDDLE_QD), NOW(l, RESISTANCE));
  was_resisted:
    go(l);
    if (l->body.N[STATE]) break;
  }
  return l->body.N[PLACE] = DONE;
}

/* MuJoCo would end the process: an error ends its simulation alone. What it warns of is counted, and is no reason to print. */
typedef struct {
  int32_t level, topic;
  char subject[1024];
} Message;

enum { ERROR = 3 };
typedef void Handler(const Message *);
static _Thread_local jmp_buf *rescue;
static _Thread_local Body *stepping;
static Handler *other;

static void handle(const Message *message) {
  if (!rescue) {
    if (other) other(message);
  } else if (message->level == ERROR) {
    memcpy(stepping->complaint, message->subject, sizeof message->subject);
    stepping->N[STATE] = STOPPED;
    longjmp(*rescue, 1);
  }
}

void catch_errors(Handler *(*set)(Handler *)) {
  Handler *before = set(handle);
  if (before != handle) other = before;
}

static int64_t guarded(int64_t (*run)(Body *, int64_t), Body *b, int64_t until) {
  jmp_buf here;
  stepping = b;
  rescue = &here;
  int64_t place = setjmp(here) ? DONE : run(b, until);
  rescue = 0;
  return place;
}

/* Loops to before a physics step; where they have stopped, all at the same place. */
int64_t run_loops(Loop *loops, int64_t count, int64_t until) {
  int64_t place = DONE;
  for (Loop *l = loops; l < loops + count; l++)
    if (!l->body.N[STATE]) {
      int64_t stop = guarded(advance, &l->body, until);
      if (!l->body.N[STATE]) place = stop;
    }
  return place;
}
