"""From pressure to displacement of an elastic body, by fast Fourier transforms."""
