/* A part of a simulation at work: encoder, controller, drive or friction, in C. Python gives it its numbers (sim/part.py). */
#include <math.h>
#include <stdint.h>
#include <string.h>

#define PI 3.141592653589793
#define ROW(part, row) ((part)->x + (row) * (part)->n)

typedef struct {
  void *run;         /* the function; none where Python stands in */
  int64_t n, stride; /* joints, and how far apart their numbers are in MuJoCo's arrays */
  double h;          /* physics step [s] */
  double *x;         /* parameters, then what is remembered, shape (row, joint) */
  double *s[4];      /* signals, shape (sample, joint); none that it does not have */
  void **o;          /* addresses of whatever else it needs */
} Part;

typedef void Sampled(Part *, int64_t k, const double *q, double *out); /* an encoder or a controller */
/* A drive: rows of position and speed; gives rows of torques, and of `traced` signals, and how many: 1 or all. */
typedef int64_t Driving(Part *, int64_t rows, int64_t steps, const double *demand, const double *q, const double *speed, double *tau,
                        double *trace);
typedef void Resisting(Part *, const double *tau, const double *qd, double *out); /* a friction */

/* Not fmin and fmax: they would hide that a number is none. */
static inline double lower(double x, double most) { return x > most ? most : x; }
static inline double higher(double x, double least) { return x < least ? least : x; }
static inline double within(double x, double limit) { return lower(higher(x, -limit), limit); }
static inline double sign(double x) { return x > 0 ? 1 : x < 0 ? -1 : x; }
