//! Tests of the stripe pattern.
