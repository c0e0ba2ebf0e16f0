#error "marks of one processor alone"
