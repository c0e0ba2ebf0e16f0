double tgamma(double x)
{
    this does not compile, and is not reached
}
