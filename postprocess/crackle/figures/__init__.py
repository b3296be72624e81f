"""What a figure shows, a module a subject, and how every figure looks (style)."""
