//! The programs of the book, compiled and run. The chapters are in `book/src`; `just book` builds
//! their pages.
#![cfg(doctest)]

#[doc = include_str!("../book/src/introduction.md")]
struct Introduction;

#[doc = include_str!("../book/src/first_system.md")]
struct FirstSystem;

#[doc = include_str!("../book/src/models.md")]
struct Models;

#[doc = include_str!("../book/src/closures.md")]
struct Closures;

#[doc = include_str!("../book/src/compiler_messages.md")]
struct CompilerMessages;

#[doc = include_str!("../book/src/manifolds.md")]
struct Manifolds;

#[doc = include_str!("../book/src/dissipation_potentials.md")]
struct DissipationPotentials;

#[doc = include_str!("../book/src/methods.md")]
struct Methods;

#[doc = include_str!("../book/src/lattices.md")]
struct Lattices;

#[doc = include_str!("../book/src/open_systems.md")]
struct OpenSystems;

#[doc = include_str!("../book/src/sensitivities.md")]
struct Sensitivities;

#[doc = include_str!("../book/src/noise.md")]
struct Noise;

#[doc = include_str!("../book/src/sweeps.md")]
struct Sweeps;

#[doc = include_str!("../book/src/recipes.md")]
struct Recipes;

#[doc = include_str!("../book/src/verification.md")]
struct Verification;

#[doc = include_str!("../book/src/output.md")]
struct Output;

#[doc = include_str!("../book/src/units.md")]
struct Units;

#[doc = include_str!("../book/src/guarantees.md")]
struct Guarantees;

#[doc = include_str!("../book/src/performance.md")]
struct Performance;
