#error "exp of one processor alone"
double exp(double x)
{
    return x;
}
