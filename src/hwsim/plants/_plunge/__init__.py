"""`PlungeGrinder`: a bore or shaft under the wheel, with gauges, lag, feed steps."""
