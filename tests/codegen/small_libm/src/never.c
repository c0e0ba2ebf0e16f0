int small_never_used = "this { would not compile";
