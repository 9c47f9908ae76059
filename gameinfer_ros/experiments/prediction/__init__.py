"""The study of prediction: errors with and without inference."""
