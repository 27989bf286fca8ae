/* The motion of one joint with its servo, step by step: one body, or rotor and link with free play (see closed_loop.py). */
#include <math.h>
#include <stdint.h>

#define LIGHT 1e-9 /* inertia of a link that has none, beside that of its rotor */

typedef struct { /* ServoLaw */
  double a, b, Ia, Fs, Fv, offset, delay, rate, lag, lead, dead_band, gain_error, scale_error, zero, bias, backlash, Mg, Fo, Fst, vs,
      Fl, Fls, Fle, Flm, Flq, Fgd, Fgb;
} Law;

typedef struct { /* what is known of a loop (Servo): command per rad and per rad/s, limits, angle of a count or 0; TimeSteps */
  double gain, kd, limit, speed_limit, angle, joint, loop, early, step, yielding, decay;
} Firmware;

typedef struct { /* what a joint gets at each step: command, voltage, share of the step with torque on, and its load */
  const double *command, *forward, *voltage, *on, *inertia, *sine, *cosine, *rest, *lightness, *shaking;
} Track;

typedef struct { /* what acts in a step */
  double on, J, damping, push, external, lightness, shaking;
} Acting;

static double within(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

/* Torque by which friction can resist at most [N m]; exports/servo.py.txt has the same in Python. */
double servo_friction(const Law *p, double speed, double motor, double external, double sent) {
  double total = p->Fs, load = fabs(external - motor);
  if (p->Fst != 0 || p->Fls != 0) total += (p->Fst + p->Fls * load) * exp(-fabs(speed) / p->vs);
  total += p->Fl * load + fabs(p->Fle * external - p->Flm * motor);
  if (external * motor < 0) total += p->Flq * fmin(external * external, motor * motor);
  return total + p->Fgd * fmax(sent, 0) + p->Fgb * fmax(-sent, 0);
}

/* Speed after a step in which friction takes away at most `most`: it resists the motion that there was until that ends, within
   the step or not, and takes of what drives it on from there at most all. */
static double slowed(double free, double speed, double most) {
  double change = free - speed, slower = change - copysign(most, speed), onward = speed + slower;
  if (onward * speed > 0) return onward;
  double left = onward * speed < 0 ? 1 + speed / slower : 1;
  return left * (change - within(change, -most, most));
}

/* Torque of the winding without what damps, and the damping of the loop: nothing beyond its limit. */
static double pushed(const Law *p, const Firmware *f, double q, double speed, double target, double forward, double V, double *damped) {
  double gain = f->gain * (1 + p->gain_error), seen = q - p->offset, damping = f->kd;
  if (f->angle > 0) seen = rint(seen / f->angle) * f->angle;
  double error = target * (1 + p->scale_error) + p->zero - seen, led = error - p->lead * speed;
  if (fabs(led) > p->dead_band) {
    error -= copysign(p->dead_band, led);
    damping += gain * p->lead;
  } else error = 0;
  double free = gain * error + forward, wanted = free - damping * speed;
  double highest = f->limit * within(1 - speed / f->speed_limit, 0, 1), lowest = -f->limit * within(1 + speed / f->speed_limit, 0, 1);
  *damped = wanted > highest || wanted < lowest ? 0 : p->a * V * damping;
  return p->a * V * (wanted > highest ? highest : wanted < lowest ? lowest : free);
}

/* Speed of rotor and link as one body after a step. */
static double after(const Law *p, const Firmware *f, const Acting *of, double speed, double h) {
  double damping = p->b * of->on + of->damping, light = 1 / (of->J + p->Ia + f->joint * p->Fv + f->loop * damping);
  double half = h / 2 * (damping + p->Fv) * light, later = h * light / (1 + half);
  double free = speed + later * (of->push + of->external - (damping + p->Fv) * speed), motor = of->push - damping * speed;
  double sent = copysign(light, free) * (of->J * motor - p->Ia * of->external);
  double resisting = servo_friction(p, speed, motor, of->external, sent) + p->Fo * (1 - of->on);
  if (f->decay > 0) { /* MuJoCo's, which lets a joint creep: (a + B v) / (A + R) within the largest */
    double taken = 2 * (fmax(f->joint, 0) * p->Fv + fmax(f->loop, 0) * damping);
    double A = (1 + taken * of->lightness) / (of->J + p->Ia + taken), seen = later * (f->decay * speed + of->shaking);
    double wanted = (A * (free - speed) + seen) / (A + f->yielding);
    return free - within(wanted, -later * resisting, later * resisting);
  }
  return slowed(free, speed, later * resisting);
}

/* Speed of the link; the rotor's, and their gap: each by itself, and as one body where one would leave the play. */
static double apart(const Law *p, const Firmware *f, const Acting *of, double link, double *rotor, double *gap, double h) {
  double half = p->backlash / 2, J = fmax(of->J, LIGHT * p->Ia), free_link = link + h / J * of->external;
  Acting alone = {of->on, 0, of->damping, of->push, 0, 0, 0}, both = {of->on, J, of->damping, of->push, of->external, 0, 0};
  double free_rotor = after(p, f, &alone, *rotor, h), free_gap = *gap + h * (free_rotor - free_link);
  if (fabs(free_gap) <= half) {
    *rotor = free_rotor;
    *gap = free_gap;
    return free_link;
  }
  /* How fast the rotor goes to the end of the play within the step; they collide without rebound. */
  double end = copysign(half, free_gap), closing = (end - *gap) / h;
  *rotor = after(p, f, &both, (J * (link + closing) + p->Ia * *rotor) / (J + p->Ia), h);
  *gap = end;
  return *rotor - closing;
}

/* Mean over each step h [s] of what follows a command within a rate [rad/s], low-passed with a time constant; it begins `ahead` of
   the first command [rad]. */
void servo_targets(const double *command, int64_t n, double rate, double h, double lag, double ahead, double *means) {
  double target = command[0] + ahead, late = target, follow = lag > 0 ? exp(-h / lag) : 0;
  for (int64_t i = 0; i < n; i++) {
    double step = within(command[i] - target, -rate * h, rate * h);
    means[i] = target + (rate < INFINITY ? step * (1 - fabs(step) / (2 * rate * h)) : step);
    target += step;
    if (lag > 0) {
      double before = late, held = means[i];
      late = held + (before - held) * follow;
      means[i] = held + (before - held) * (1 - follow) * lag / h;
    }
  }
}

/* Angle of the log at each step [rad]; no speed gets beyond the fastest.

   It starts from an angle of the log, a speed, and by how much the target is ahead of the command. Leapfrog: speeds in the middle
   of steps, positions at their ends; damping is implicit, so that the result is of second order in the step h [s]. A force acts
   for the step about its instant: means of the target over steps are delayed by parts of them. */
static void motion(const Law *p, const Firmware *f, const Track *track, int64_t n, const double *start, double h, double fastest,
                   double *means, double *out) {
  double q = start[0] + p->offset, speed = start[1], rotor = speed, gap = 0, first = track->command[0] + start[2];
  double late = (p->delay - f->early) / h + 0.5, half = p->backlash / 2;
  int64_t whole = (int64_t)floor(late);
  double part = late - whole;
  servo_targets(track->command, n, p->rate, h, p->lag, start[2], means);
  for (int64_t i = 0; i < n; i++) {
    int64_t at = i - whole;
    out[i] = q - p->offset;
    double now = at >= 0 ? means[at < n ? at : n - 1] : first, past = at > 0 ? means[at - 1 < n ? at - 1 : n - 1] : first;
    double external = p->bias - ((track->sine[i] + p->Mg) * sin(q) + track->rest[i]), damping;
    if (track->cosine[i] != 0) external -= track->cosine[i] * cos(q);
    if (i == 0 && half > 0) gap = external > 0 ? -half : external < 0 ? half : 0; /* links rest where their loads push them */
    double forward = track->forward[at < 0 ? 0 : at < n ? at : n - 1];
    double push = pushed(p, f, q, speed, now + (past - now) * part, forward, track->voltage[i], &damping);
    Acting of = {track->on[i], track->inertia[i], damping, push, external, track->lightness[i], track->shaking[i]};
    speed = half > 0 ? apart(p, f, &of, speed, &rotor, &gap, h) : after(p, f, &of, speed, h);
    speed = within(speed, -fastest, fastest);
    rotor = within(rotor, -fastest, fastest);
    q += h * speed;
  }
}

/* Positions at samples between steps, linearly, for each of `lanes` laws and beginnings; at rest to the count [rad], if above 0. */
void servo_lanes(const Law *laws, const double *starts, int64_t lanes, const Firmware *f, const Track *track, int64_t n, double h,
                 double fastest, const int64_t *before, const double *share, int64_t samples, double count, double *work, double **out) {
  for (int64_t lane = 0; lane < lanes; lane++) {
    motion(laws + lane, f, track, n, starts + 3 * lane, h, fastest, work, work + n);
    for (int64_t k = 0; k < samples; k++) {
      const double *q = work + n + before[k];
      double change = q[1] - q[0], x = q[0] + change * share[k];
      out[lane][k] = change == 0 && count > 0 ? rint(x / count) * count : x;
    }
  }
}
