"""`PlungeGrinder`: a bore or shaft under the wheel, gauges, lag, quantum."""
