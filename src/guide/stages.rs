//! Methods with stages: their equations, what is proved of them, and the sources.
//!
//! [`Gauss`](crate::integrators::Gauss) and [`Radau`](crate::integrators::Radau) have the nodes `c_i` and the weights `a_ij`, `b_j > 0` of their
//! tableau. For a function `F` of the state let
//!
//! ```math
//! \delta_F = F(x') - F(x) - h \sum_i b_i \langle dF(X_i), v_i\rangle .
//! ```
//!
//! # The step
//!
//! A step with the displacement `d` has its middle at `z`. In the chart at `z` it starts at `−d/2` and ends at `d/2`, and its stages are
//!
//! ```math
//! X_i = \varphi_z\Bigl(-\tfrac12 d + h \sum_j a_{ij} k_j\Bigr), \qquad d = h \sum_j b_j k_j, \qquad v_i = T\varphi_z\, k_i .
//! ```
//!
//! Each function among `H`, `S` and the further invariants `L_a` has one number for all stages:
//!
//! ```math
//! a_F = \frac{\delta_F}{h \sum_i b_i\, G(v_i, v_i)}, \qquad w_{F,i} = dF(X_i) + a_F\, ♭v_i , \qquad
//! v_i = \tilde\Pi_i\, w_{H,i} + \tilde K_i\, w_{S,i} .
//! ```
//!
//! The last equation is that of the midpoint scheme, with its projections. With one stage it *is* this scheme
//! (`tests/collocation.rs::one_stage_is_the_scheme_of_the_paper`). A metric of your own enters by `♭`, the dissipation and the volume; the path is
//! that of the space, so no geodesic is integrated.
//!
//! # Both laws
//!
//! **Theorem 1.** *For every step that is solved, `ΔH = ΔL_a = 0` and `ΔS = h Σ b_i K_i(w_{S,i}, w_{S,i}) ≥ 0`.*
//!
//! *Proof.* By the definition of `a_F`, `h Σ b_i ⟨w_{F,i}, v_i⟩ = F(x') − F(x)`. At each stage `Π̃_i` is skew and annihilates `w_{S,i}`, and
//! `K̃_i` annihilates `w_{H,i}` and `w_{L,i}`. So `⟨w_{H,i}, v_i⟩ = 0`, `⟨w_{L,i}, v_i⟩ = 0`, and `⟨w_{S,i}, v_i⟩ = K_i(w_{S,i}, w_{S,i})`. ∎
//!
//! It needs no assumption on the nodes, the chart or the step size, but one on the model: listed Casimirs are independent of the entropy.
//! Where `dS` becomes a combination of `dH` and of listed Casimirs, the projections fade out, and the end of the step is moved onto the Casimirs. On
//! so(5)*, where `tr X⁴` reaches its maximum on `|x|² = C`, `Gauss::<2>` keeps `H` and `C`, and `S` falls by up to 4.3·10⁻¹⁴, on 140 of 500
//! steps of 0.2; the certificate counts these falls. A step there that changes a Casimir, or lowers `S`, by more than 50 roundings of
//! the terms of the law is not taken.
//!
//! # The order
//!
//! **Theorem 2.** *The Gauss method of `s` stages has order `2s`, uniformly up to equilibrium.*
//!
//! *Proof.* Let `u` be the polynomial of degree `s` with `u' = k_i` at the nodes, and `g = dF(u(t))/dt`. Then `δ_F` is the error of the
//! `s`-point Gauss rule for `∫g`, a multiple of `h^{2s+1} g^{(2s)}`. This derivative is a sum of terms `F^{(m)}(u^{(i₁)}, …, u^{(i_m)})` with
//! `i₁ + … + i_m = 2s + 1`. A term with `m = 1` or `m = 2` has an index above `s`, and `u^{(i)} = 0` for `i > s`. So three factors or more are
//! left, `δ_F = O(h^{2s+1}|v|³)`, and `a_F ♭v = O(h^{2s}|v|²)`. The stages are those of collocation for a vector field that is perturbed by
//! `O(h^{2s})` in relation to `|v|`, and collocation at Gauss nodes has order `2s`. ∎
//!
//! For Radau nodes `δ_F = O(h^{2s})`, and the order is `2s − 1`. The tests `orders_…` of `tests/collocation.rs` fit these orders on nine problems.
//!
//! Exchange the ends of a step and the sign of `h`: `d` changes its sign, `z` does not, and symmetric nodes are exchanged among themselves. So a
//! Gauss step of `h` and one of `−h` lead back (`gauss_steps_lead_back`, to 2e-15).
//!
//! # No exact balance can damp
//!
//! **Theorem 3.** *No method with `b_i > 0` and `ΔS = h Σ b_i K(w_i, w_i)`, `v_i = K w_i`, damps stiff friction, if its stages `h v_i` stay
//! bounded as `hλ → ∞`.*
//!
//! *Proof.* Take one variable `y` with `S = −½λy²` and `K = 1`, so `y' = −λy`. The balance says `½λ(y₀² − y₁²) = h Σ b_i v_i²`. If `y₁ → 0`, then
//! `Σ b_i (h v_i)²` tends to `½hλ y₀²`, which is not bounded. ∎
//!
//! At `hλ = 10³` the Gauss methods leave 0.996, 0.988, 0.976 and 0.961 of a deviation, with alternating signs
//! (`one_step_damps_a_stiff_component`). So do all methods here with an exact balance.
//!
//! # How Radau damps
//!
//! Radau's tableau is algebraically stable: for quadratic `F` with the Hessian `Q`, `δ_F = −½h² Σ m_ij Q(v_i, v_j)` with a matrix `m ⪰ 0`. Left
//! alone the method gains entropy where `S` is concave, and loses energy where `H` is convex. Both happen when friction is damped; only
//! `S − βH` has a maximum at an equilibrium. To correct *either* of them undoes the damping. So `Radau` corrects the entropy only where it
//! would fall, and the fraction `τ` of `δ_H` that friction has caused becomes heat:
//!
//! ```math
//! v_i = \tilde\Pi_i\, w_{H,i} + \tilde K_i\, w_{S,i} + \rho\, u_i, \qquad h \rho = -\tau\, \delta_H, \qquad
//! u_i = \frac{♯ n_i}{\langle w_{H,i}, ♯ n_i\rangle} ,
//! ```
//!
//! with the part `n_i` of `dS` that is orthogonal to the invariants and to the entries that friction does not move, whose rows of `K` are zero at
//! the start of the step: a gas below a piston is warmed, and its piston is not shifted. The rest of `δ_H` is corrected as before.
//!
//! **Theorem 4.** *For every step of `Radau` that is solved, `ΔH = ΔL_a = 0` and `ΔS = h Σ b_i K_i(w_{S,i}, w_{S,i}) + max(N, 0)`, with
//! `N = δ_S + hρ Σ b_i ⟨dS, u_i⟩`.*
//!
//! *Proof.* `ΔH = h Σ b_i ⟨w_{H,i}, v_i⟩ + τδ_H = hρ + τδ_H = 0`, and `⟨w_{L,i}, u_i⟩ = 0`. If `N ≥ 0` then `w_S = dS`, and
//! `ΔS = h Σ b_i ⟨dS, v_i⟩ + δ_S`. If `N < 0` then `w_S = dS + a_S ♭v`, with the `a_S` for which
//! `h Σ b_i ⟨w_{S,i}, ρu_i⟩ + δ_S = a_S h Σ b_i G(v_i, v_i)`. ∎
//!
//! At `hλ = 10³` one step leaves 0.002, 0.003 and 0.004 of a deviation. With friction that is not stiff there is a surplus `N` of the order of the
//! error, so `Gauss` is the method for motions that are not stiff. Where friction vanishes at every stage, both laws are corrected, and the
//! entropy is constant.
//!
//! The sign of `⟨dH, ♯n⟩` is that of the temperature. Near an infinite one, below a tenth of its terms with the largest entries of `dH` at
//! the stages, heat has no direction: it is reduced to zero and the energy is corrected instead. So a run passes from positive to
//! negative temperatures, as spins do (`orders_through_infinite_temperatures`). A root beyond a temperature of zero is refused: there
//! `⟨dH, ♯n⟩` changes its sign through infinity.
//!
//! # Explicit methods
//!
//! The stages of [`DormandPrince8`](crate::integrators::DormandPrince8) are those of Dormand and Prince, in a rational chart of the space. The
//! entropy is integrated along, `S* = S + h Σ b_i σ_i` with the production `σ = ⟨dS, K dS⟩` of each stage, and the end of the step is moved onto
//! `{H = H₀, L = L₀, S = S*}` by Newton's method along the differentials; usually one correction is enough. The entropy is off by the error of
//! the *production*, which is smaller than that of a plain method in proportion to the friction. Near an equilibrium the entropy depends on the
//! energy, and the projection leaves it free: a step on which it would fall is rejected, so the steps stay within the region of stability.
//!
//! # What is known, and what seems new
//!
//! One number per step that conserves the energy of a collocation method, on Rⁿ, is due to Brugnano, Iavernaro and Trigiante (2010); the
//! correction along the velocity to Gonzalez (1996), in Galerkin form to Gross, Betsch and Steinmann (2005). Andrews and Farrell (2025) conserve
//! energy and entropy balance by averaged covectors on Rⁿ, and prove order `s`. The blended iteration is due to Brugnano and Magherini (2002),
//! algebraic stability to Burrage and Butcher (1979). We know of no source for: one number per function with the projected bracket, on
//! manifolds and in a reversible chart; order `2s` up to equilibrium; Theorem 3; heat as the way to conserve the energy of a method that damps.
