#include <math.h>
#include "parts.h"

double cos(double x)
{
    int quadrant;
    double r = small_reduced(x, &quadrant);
    double found = __sin(r, (quadrant + 1) % 2);
    return (quadrant == 1 || quadrant == 2) ? -found : found;
}
