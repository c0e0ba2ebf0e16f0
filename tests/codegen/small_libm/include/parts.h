/* What the functions share; "marks.h" is that of every processor. */
#ifndef PARTS_H
#define PARTS_H

#include "marks.h"
#include <stdint.h>

#define TERMS 14
#define nearest(x) floor((x) + 0.5)

/* another library may have this name for a function of its own */
hidden double __sin(double share, int odd);
hidden double small_reduced(double x, int *quadrant);
extern hidden const struct inverse_factorials {
    double of[TERMS];
} small_factorials;
extern int small_never_used;

static inline double horner(const double *c, int count, double x)
{
    double sum = c[count - 1];
    for (int k = count - 2; k >= 0; k--) {
        sum = sum * x + c[k];
    }
    return sum;
}

#endif
