//! Promises where capabilities cross: from rest, across corners, at events, with noise, where runs begin and end. Each input was
//! reported or found by a search from outside, with its right value by a closed form or by another method.

#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "counts are small whole numbers, and the numbers that are compared have no rounding"
)]

mod corners;
mod events;
mod fits;
mod from_rest;
mod ledger;
#[path = "../models/methods.rs"]
mod methods;
mod model;
mod noise;
mod numerics;
mod radau;
#[path = "../models/stages.rs"]
mod stages;
mod starts;
