//! Errata of the paper, with derivations, and how the library differs.
//!
//! The scheme is that of A. Bloch, M. Farré Puiggalí and D. Martín de Diego, *Metriplectic
//! Euler-Poincaré equations: smooth and discrete dynamics*
//! ([arXiv:2401.05220](https://arxiv.org/abs/2401.05220)). For the implementation each
//! formula was derived again. Most are right as printed, and this page lists the others. None of them affects the idea:
//! the worked-out integrator, in the example of the rigid body, is right.
//!
//! Every entry has a test in `tests/errata.rs`, which evaluates both forms. The printed form fails by the number
//! given here. The corrected form holds to round-off or has its order. Sections are those of the
//! paper, `w` is a discrete gradient of `H`, `z` the base point, `G*` the cometric, and the page
//! [`equations`](super::equations) lists everything else.
//!
//! | § | printed | correct |
//! |---|---|---|
//! | 1 | `x' − x = Π̄ ∇̄H` | `x' − x = h Π̄ ∇̄H` |
//! | 2.1 | `Π = Π^{ij} ∂_i ∧ ∂_j` | `Π = ½ Π^{ij} ∂_i ∧ ∂_j` |
//! | 2.2, remark | `K = G*(Q·, Q·)` extends eq. (semid) | `C_H` times that does |
//! | 2.4 | `♯_K(J_ξ) = 0` | `♯_K(dJ_ξ) = 0` |
//! | 2.4 | `P = TG`, `Ψ_g = T*L_g` | `P = T*G`, `Ψ_g = T*L_{g⁻¹}` |
//! | 2.4 | `P = T*G` is an example | only without entropy production |
//! | 3 | `F(ξ') = ad*_ξ 𝓕(ξ')` | `F(ξ) = ad*_ξ 𝓕(ξ)` |
//! | 3 | `𝒦`, a form on `g` | another form than the `𝒦` of §2; here `κ` |
//! | 4 | second order | with the base point in the middle; first order at the start |
//! | 4.2 | second law, `ΔS ≥ O(h³)` | `ΔS ≥ −C h³`; `≥ 0` if `S` is quadratic and `P` flat |
//! | 4.2, (semid-d) | prefactor `G*(w, w)` | none |
//! | 4.3 | `l = ½I₁Ω₁² + I₂Ω₂² + I₃Ω₃²` | `l = ½(I₁Ω₁² + I₂Ω₂² + I₃Ω₃²)` |
//! | 4.3 | `Π` with the entries `I_i p_i` | with the entries `p_i` |
//! | 4.3 | `∇̄₂H((p + P)/2)` | `∇̄₂H(p, P)` |
//! | 4.4 | `z ∈ TP` | `z ∈ P` |
//! | 4.4, (discGrad-m), (gonzalez-m) | `⟨w, R_h⁻¹⟩ = ΔH` | `h ⟨w, R_h⁻¹⟩ = ΔH` |
//! | 4.4, last formula | `Π(z_τ)`, `K_d(z) ∇C(z)` | `Π(z)`, `K_d(z) dS(z)` |
//!
//! # §1 Introduction
//!
//! **A step without its size.** *Printed:* discrete gradient methods are `x' − x = Π̄(x, x') ∇̄H(x, x')`
//! with `Π̄` an approximation of `Π`. *Correct:* `x' − x = h Π̄ ∇̄H`. Divide by `h` and let it go to zero:
//! only with the factor is the limit `x' = Π ∇H`. Without the factor the map is a step of size 1 for every `h`. Both
//! forms conserve the energy, so a test of conservation does not notice. The tumbling free body of the
//! tests moves 91 times too far for `h = 0.01`.
//! (`tests/errata.rs::a_step_without_its_size_is_a_step_of_size_one`)
//!
//! # §2.1 Poisson structures
//!
//! **The bivector in coordinates.** *Printed:* `Π = Π^{ij} ∂_i ∧ ∂_j`, summed over all `i` and `j`, with
//! `Π^{ij} = {x^i, x^j}`. *Correct:* half of it, or the sum over `i < j`. By definition
//! `(∂_i ∧ ∂_j)(df, dg) = f_i g_j − f_j g_i`, and `Π^{ij}` is skew, so
//!
//! ```math
//! \sum_{i,j} \Pi^{ij} (\partial_i \wedge \partial_j)(df, dg)
//!   = \Pi^{ij} f_i g_j - \Pi^{ij} f_j g_i = 2\, \Pi^{ij} f_i g_j = 2 \{f, g\} .
//! ```
//!
//! The formulas for `{f, g}` and `X_f` next to it are right.
//! (`tests/errata.rs::a_double_sum_over_wedges_counts_every_bracket_twice`)
//!
//! # §2.2 Positive semidefinite inner products
//!
//! **The scale of the remark.** With more functions to be conserved the remark takes
//! `K(α, β) = G*(Qα, Qβ)`, where
//! `Qα = α − C^{ab} G*(dL_a, α) dL_b` projects off the span of the `dL_a`, `C_{ab} = G*(dL_a, dL_b)`,
//! `C^{ab}` is the inverse matrix and `1 ≤ a, b ≤ N`. (The remark does not say that `C^{ab}` is the
//! inverse, and gives a range to `a` only.) Let `L_1 = H` be alone, and expand, with
//! `C_H = G*(dH, dH)`:
//!
//! ```math
//! G^*(Q\alpha, Q\beta) = G^*(\alpha, \beta) - \frac{G^*(dH, \alpha)\, G^*(dH, \beta)}{C_H}
//!   = \frac{1}{C_H}\, K_{\text{(semid)}}(\alpha, \beta) .
//! ```
//!
//! So the same letter has two scales, and the remark does not extend the equation before it. *Correct*, as an
//! extension: `K(α, β) = C_H G*(Qα, Qβ)`. Both annihilate the `dL_a` and are positive semidefinite. They differ in time
//! scale, by `C_H = |Ω|²` for a body: at the start of the paper's example the remark produces entropy 25 times as fast.
//! They also differ near an equilibrium of `H`. There `K` of (semid) vanishes like `|dH|²`, and `K` of the remark keeps
//! its norm and has no limit.
//!
//! The library uses `C_H G*(Qα, Qβ)` in both cases, [`MetricDissipation`](crate::dynamics::MetricDissipation) with or
//! without further invariants, so listing an invariant does not change the time scale. For another scale put `κ(x)` in
//! front, [`MetricDissipation::scaled`](crate::dynamics::MetricDissipation::scaled). The scale of the remark is
//! `κ = 1/C_H`.
//! (`tests/errata.rs::the_remark_has_another_scale_than_the_equation_before_it`)
//!
//! # §2.4 Symmetry preservation
//!
//! **A function where its differential is meant.** *Printed:* `(f, J_ξ) = 0` for all `f`, "or equivalently
//! `♯_K(J_ξ) = 0`". *Correct:* `♯_K(dJ_ξ) = 0`, since `♯_K` acts on covectors and `J_ξ` is a number at each
//! point. The condition is not automatic. An oscillator in the plane with a bath, `H = ½|q|² + ½|p|² + s`
//! and `S = s`, is invariant under rotations, and so is its metric. Yet (semid) gives
//! `(J, S) = −G*(dH, dJ) = −2J`. So the angular momentum `J` decays as `exp(−2t)`, to 0.135 of its value at
//! `t = 1`. If `J` is one of the `L_a` of the remark,
//! [`momentum`](crate::dynamics::SystemBuilder::momentum), it is conserved to round-off.
//! (`tests/errata.rs::a_momentum_is_kept_if_its_differential_is_annihilated`)
//!
//! **The bundle.** *Printed:* "the case when `P = TG`". *Correct:* `P = T*G`, which the next line of the paper
//! uses. `TG` has no Poisson bracket before a Lagrangian is chosen, and momentum maps take values in `g*`.
//! For a free body the spatial momentum `Rp` is conserved, `(Rp)' = R(Ω × p + p × Ω) = 0`. The same formula
//! with the velocity is not, `(RΩ)' = R I⁻¹(p × Ω)`: 0.087 at a point where `|Ω|` is 0.91.
//! (`tests/errata.rs::the_momentum_of_a_body_is_a_covector_and_its_velocity_is_not_kept`)
//!
//! **The action.** *Printed:* the left action `Ψ_g = T*L_g`. *Correct:* `Ψ_g = T*L_{g⁻¹}`. The cotangent lift
//! goes backwards, `T*L_g: T*_{gx}G → T*_xG`, so
//! `Ψ_g Ψ_h = T*L_g T*L_h = T*(L_h L_g) = Ψ_{hg}`: a right action. For the two quarter turns about the first
//! two axes, `Ψ_g Ψ_h` and `Ψ_{gh}` are √6 apart in the Frobenius norm.
//! (`tests/errata.rs::the_pull_back_by_a_left_translation_acts_from_the_right`)
//!
//! **What the example excludes.** *Printed:* under the conditions of this section, the systems of §3 are
//! reductions of metriplectic systems on `T*G`, whose momentum maps are conserved. *Correct:* only if they
//! produce no entropy. Let `J` be the momentum map of left translation (`J = Rp` on SO(3)) and `C` a
//! Casimir of `g*`. Casimirs are invariant under the coadjoint action, so `C(p) = C(J)`, a function of the
//! conserved quantities, and
//!
//! ```math
//! dC = \sum_i \frac{\partial C}{\partial J_i}\, dJ_i , \qquad
//! K\, dJ_\xi = 0 \text{ for all } \xi \quad\Longrightarrow\quad K\, dC = 0, \quad C' = (C, C) = 0 .
//! ```
//!
//! Nor is `C` a Casimir of the canonical bracket on `T*G`, which has none but constants:
//! `Π dC = (p, 0) ≠ 0` on `T*SO(3)`. The metriplectic system lives on `g*` from the start; reconstructed in
//! space, friction changes the spatial momentum by `(Rp)' = R K dS`. For the relaxing body of the paper
//! `|Rp|² = 2S` doubles. A body that rotates in space, with both laws, needs a bath:
//! `Product(Product(Rotations, Euclidean::<3>), Euclidean::<1>)` and `S = s`.
//! (`tests/errata.rs::before_reduction_the_entropy_is_no_casimir_and_a_function_of_the_momentum`)
//!
//! # §3 Forced Euler-Poincaré equations
//!
//! **Which velocity turns the force.** *Printed:* `F(ξ') = ad*_ξ 𝓕(ξ')` for `ξ' ∈ g`, where `ξ` is not an
//! argument. *Correct:* `F(ξ) = ad*_ξ 𝓕(ξ)`, with one velocity, as in eq. (fel). The energy changes by the
//! power of the force at the velocity of the motion,
//!
//! ```math
//! \langle F(\xi'), \xi' \rangle = \langle \mathrm{ad}^*_\xi \mathcal F(\xi'), \xi' \rangle
//!   = \langle \mathcal F(\xi'), [\xi, \xi'] \rangle ,
//! ```
//!
//! which vanishes for every `𝓕` if `ξ' ∥ ξ`, and otherwise does not: 0.9567 for the vectors of the test.
//! (`tests/errata.rs::a_force_turned_by_another_velocity_does_work`)
//!
//! **One letter for two forms.** §2 has `𝒦` on covectors of `P`, with `𝒦(dH, ·) = 0`. Eq. (sem) has `𝒦` on `g`,
//! "an arbitrary positive semidefinite scalar product". Covectors of `g*` are elements of `g`, so the two are easily
//! confused. Here the form on the algebra is `κ`. With
//! `⟨F(ξ), η⟩ = κ(η, [ξ, dC])`, eq. (ops1),
//!
//! ```math
//! \langle \mathrm{ad}^*_\xi F(\xi), \eta \rangle = \langle F(\xi), [\xi, \eta] \rangle
//!   = \kappa([\xi, \eta], [\xi, dC]) = K(\eta, dC), \qquad
//! K(\alpha, \beta) = \kappa([\xi, \alpha], [\xi, \beta]), \quad \xi = dH ,
//! ```
//!
//! which annihilates `dH` because `[ξ, ξ] = 0`. This is
//! [`CasimirDissipation`](crate::dynamics::CasimirDissipation). `κ` in the place of `K` would give
//! `H' = κ(dH, dC)`. For the body with `κ = 1` and `C = ½|p|²` this is `Ω·p = 2H`, 0.924 at the point of
//! the test. (On so(3) with `κ = 1` the `K` of `κ` is (semid), which invites the confusion. This `κ` is not the factor
//! `κ(x)` above.)
//! (`tests/errata.rs::the_form_on_the_algebra_is_not_the_form_on_covectors`)
//!
//! # §4 Generic integrators
//!
//! **The order.** *Printed:* the section opens with "a second order integrator", and §4.4 offers two
//! retractions for it. *Correct:* the order is 2 with the base point in the middle,
//! [`WeylMidpoint`](crate::manifolds::WeylMidpoint); order 1 with the exponential at `x`,
//! [`Exponential`](crate::manifolds::Exponential). On Rⁿ with `z = x` the scheme is
//! `x' = x + h (Π(x) w + K_w(x) dS(x))`, and `w = dH(x) + O(h)`, while the flow is
//!
//! ```math
//! x + h f(x) + \tfrac{1}{2} h^2 f'(x) f(x) + O(h^3), \qquad f = \Pi\, dH + K\, dS .
//! ```
//!
//! The second-order term `½ f' f` needs `Π` and `K` half a step later, but they are evaluated at `x`. Now let `z`
//! be the middle of the geodesic and `w` Gonzalez' covector. Exchanging `x` with `x'` and `h` with `−h` gives the same
//! equation. So the method is symmetric and its order even. The orders fitted on the spinning top of Celledoni,
//! Eidnes, Owren and Ringholm ([arXiv:1805.07578](https://arxiv.org/abs/1805.07578)) are 1.00 and 2.00.
//! (`tests/errata.rs::the_exponential_at_the_start_is_of_first_order`)
//!
//! **The second law.** *Printed:* the proposition "second law", `S(x_{k+1}) − S(x_k) ≥ O(h³)`. *Correct:*
//! `S(x_{k+1}) − S(x_k) ≥ −C h³`, a bound on the loss, not a law, because the term has either sign.
//! The proof is a Taylor expansion about the midpoint,
//!
//! ```math
//! S(x') - S(x) = h\, \langle dS(z), v \rangle + O(h^3)
//!   = h \underbrace{\langle dS(z), \Pi(z) w \rangle}_{0} + h \underbrace{K_d(dS, dS)}_{\ge 0} + O(h^3) ,
//! ```
//!
//! and the last term is absent if `S` is quadratic and `P` flat, as in the example: there
//! `ΔS = h K_d(dS(z), dS(z)) ≥ 0` exactly. In other cases the law fails if the entropy production is
//! smaller than `h²`. Two gas containers with a wall that hardly conducts (Shang and Öttinger 2020) lose entropy on 150
//! of 300 steps of `h = 0.1`, up to 1.4e-3 in a step. With `h = 0.025` they lose entropy on 500 of 1200 steps. Without
//! conduction the largest loss in a step falls with the fitted order 3.
//!
//! The remedy is a discrete gradient `w_S` of `S` in the place of `dS(z)`, and the bracket `PΠPᵀ`, where `Pᵀ` projects
//! off `w_S`. Then `ΔS = h ⟨w_S, v⟩ = h K(w_S, w_S) ≥ 0`. The order is 2, because `Π dS = 0` makes `P` a change of
//! `O(h²)`. This is [`SecondLaw::Exact`](crate::dynamics::SecondLaw::Exact), the default (for a flat space, with
//! other tensors, Romero 2009). It lowers the entropy of the containers on no step.
//! (`tests/errata.rs::the_published_scheme_lowers_the_entropy_and_by_third_order_only`)
//!
//! **The factor in (semid-d).** *Printed:*
//! `K_d(α, β) = G*(w, w) [G*(w, w) G*(α, β) − G*(w, α) G*(w, β)]`. *Correct:* the bracket alone. It is eq. (semid)
//! with `dH` replaced by `w`; the factor in front remains as the points meet, `K_d → C_H K`. So the step
//! is consistent with another equation, `x' = Π dH + C_H K dS`, and its order is 0. Energy and the sign of entropy
//! production are those of a metriplectic scheme, so a test of conservation does not notice. The
//! example of §4.3 has no such factor. With it, the relaxing body is off by 8.86e-3 at `t = 10` with 200
//! and with 3200 steps; without it the error falls with order 2.
//! (`tests/errata.rs::the_factor_in_the_discrete_form_makes_another_equation_of_it`)
//!
//! # §4.3 The relaxing rigid body
//!
//! **The Lagrangian.** *Printed:* `l = ½I₁Ω₁² + I₂Ω₂² + I₃Ω₃²`. *Correct:* `l = ½(I₁Ω₁² + I₂Ω₂² + I₃Ω₃²)`, as in §3.
//! `∂l/∂Ω` of the printed one is `(I₁Ω₁, 2I₂Ω₂, 2I₃Ω₃)`, not the momenta of the next line. It is the body with the
//! moments `(10, 10, 2)`: symmetric, so that the third momentum never changes.
//! (`tests/errata.rs::a_lagrangian_without_its_brackets_has_twice_the_momenta`)
//!
//! **The Poisson tensor.** *Printed:* `Π` with the entries `±I_i p_i`. *Correct:* with the entries `±p_i`, so that
//! `Π α = p × α`. Then with `Ω = ∇H`
//!
//! ```math
//! (p \times \Omega)_1 = p_2 \frac{p_3}{I_3} - p_3 \frac{p_2}{I_2} = \frac{I_2 - I_3}{I_2 I_3}\, p_2 p_3 ,
//! \qquad \Pi \nabla S = p \times p = 0 ,
//! ```
//!
//! the printed equations of motion. With the printed entries `(Π ∇H)_1 = (I_2^2 − I_3^2)/(I_2 I_3) p_2 p_3`, too
//! large by `I_2 + I_3`; the factors are 6, 11 and 15 for the three components, and `Π ∇S = (Ip) × p` is
//! 4.34 instead of zero. It is the right matrix in terms of velocities, `I_i Ω_i = p_i`. A test of the bracket
//! alone does not notice: the matrix is skew and satisfies the Jacobi identity, with the Casimir
//! `½ Σ I_i p_i²`. A run with it is refused, because `S` is not that Casimir.
//! (`tests/errata.rs::a_tensor_of_velocities_and_momenta_is_not_the_bracket_of_the_body`)
//!
//! **The arguments of the discrete gradient.** *Printed:* `∇̄₂H((P₁+p₁)/2, …) = (z₁/I₁, …)`. *Correct:*
//! `∇̄₂H(p, P) = (z₁/I₁, …)`: a discrete gradient is a function of two points. The value is right, since the
//! defect `H(P) − H(p) − ∇H(z)·(P − p)` vanishes for a quadratic `H`. The gradient at the midpoint, as literally
//! printed, is a discrete gradient only of a quadratic energy. With `¼|p|⁴` added to `H` it misses the change
//! of the energy by `¼|P − p|² z·(P − p)`, −0.0170 in the test.
//! (`tests/errata.rs::a_discrete_gradient_is_a_function_of_two_points`)
//!
//! # §4.4 Extension to differentiable manifolds
//!
//! **The base point.** *Printed:* `z = τ_P(R_h⁻¹(x, x')) ∈ TP`. *Correct:* `z ∈ P`, since `τ_P: TP → P`. (In the same
//! paragraph `τ_Q` should be `τ_P`.) Two vectors at one base point, `v` and `2v`, are different elements of `TP` with
//! the same `z`. (`tests/errata.rs::the_base_of_a_pair_is_a_point_and_not_a_vector`)
//!
//! **The missing step size.** *Printed:* `⟨∇̄H(x, x'), R_h⁻¹(x, x')⟩ = H(x') − H(x)`, and (gonzalez-m) to match. *Correct:*
//!
//! ```math
//! h\, \langle w, v \rangle = H(x') - H(x), \qquad
//! w = dH(z) + \frac{\bigl(H(x') - H(x)\bigr)/h - dH(z)\, v}{G(v, v)}\; \flat v, \qquad
//! v = R_h^{-1}(x, x') .
//! ```
//!
//! Both retractions of the section have `R_h⁻¹(x, x') = v` with a displacement `hv`; in Rⁿ it is `(x' − x)/h`, and
//! eq. (discGrad) is about `x' − x`. The last formula of the paper, `R_h⁻¹ = Π w + K_d dS`, also needs the velocity,
//! so the `h` belongs here. The printed form is not consistent. Let `e = v/|v|`; as the points meet,
//! `H(x') − H(x) ≈ h dH(v)`, and the printed covector tends to
//!
//! ```math
//! dH - (1 - h)\, dH(e)\, \flat e ,
//! ```
//!
//! not to `dH`: it depends on the direction in which `x'` approaches `x`, and is not continuous. In the test it
//! misses 0.900 of the slope along the path, at `h = 0.1`. The scheme works nevertheless, because its equation
//! implies `⟨w, v⟩ = 0`. Hence `H(x') = H(x)` by either formula, and both have the same correction
//! `−dH(z)v/G(v,v)`. A solution of one is a solution of the other. This argument holds for `H` alone. An entropy does
//! change, and its covector would be wrong at order 0. The library writes the displacement
//! `d = hv` throughout, [`Gonzalez`](crate::integrators::Gonzalez), and no `h` appears.
//! (`tests/errata.rs::a_discrete_gradient_on_a_manifold_counts_the_step`)
//!
//! **The last formula.** *Printed:* `R_h⁻¹(x_k, x_{k+1}) = Π(z_τ) ∇̄₂H + K_d(z) ∇C(z)`. *Correct:*
//! `R_h⁻¹(x_k, x_{k+1}) = Π(z) w + K_d(z) dS(z)`. `z_τ` is not defined; the point is the `z` of the next line.
//! `C` is the Casimir of §3, which is the entropy `S` here; and `K_d` acts on covectors. A gradient
//! `∇S = g⁻¹dS` in its place would make the equation depend on coordinates and violate the second law. For
//! `w = (1, 1, 0)`, `dS = (1, 0.2, 0)` on R³ the entropy production is `K(dS, dS) = 0.64`. Now replace the coordinate
//! `p_2` by `3p_2` and pull back the metric: `⟨dS, K ∇S⟩ = −0.64`, and `K(dS, dS)` is still 0.64.
//! (`tests/errata.rs::the_dissipation_acts_on_the_differential_and_not_on_the_gradient`)
//!
//! # Names only
//!
//! The following have no consequences and are not tested: the symmetric bracket is written `(df, dg)` once and `(f, g)` elsewhere
//! (§2.2); dimensions are `m` and `n` by turns (§2.1, §2.3), and eq. (matricial) has a range for an
//! index that it does not contain; eqs. (fel) and (flp) are called forced Euler-Lagrange equations, and
//! are the forced Euler-Poincaré and Lie-Poisson equations; `L(ξ(μ))` is `l(ξ(μ))` (§3); `K_d(z)` depends on
//! `w`, and so on both points and not on `z` alone (§4.2).
//!
//! # References
//!
//! - E. Celledoni, S. Eidnes, B. Owren, T. Ringholm (2020), *Energy-preserving methods on Riemannian
//!   manifolds*, [arXiv:1805.07578](https://arxiv.org/abs/1805.07578): discrete gradients with a retraction,
//!   where the displacement, and so the `h`, is in its place.
//! - O. Gonzalez (1996), *Time integration and discrete Hamiltonian systems*,
//!   [doi:10.1007/BF02440162](https://doi.org/10.1007/BF02440162).
//! - M. Grmela, H. C. Öttinger (1997), *Dynamics and thermodynamics of complex fluids I*,
//!   [doi:10.1103/PhysRevE.56.6620](https://doi.org/10.1103/PhysRevE.56.6620).
//! - T. Itoh, K. Abe (1988), *Hamiltonian-conserving discrete canonical equations based on variational
//!   difference quotients*,
//!   [doi:10.1016/0021-9991(88)90132-5](https://doi.org/10.1016/0021-9991(88)90132-5).
//! - R. I. McLachlan, G. R. W. Quispel, N. Robidoux (1999), *Geometric integration using discrete
//!   gradients*, [doi:10.1098/rsta.1999.0363](https://doi.org/10.1098/rsta.1999.0363).
//! - P. J. Morrison (1986), *A paradigm for joined Hamiltonian and dissipative systems*,
//!   [doi:10.1016/0167-2789(86)90209-5](https://doi.org/10.1016/0167-2789(86)90209-5).
//! - H. C. Öttinger (2018), *GENERIC integrators: structure preserving time integration for
//!   thermodynamic systems*, [doi:10.1515/jnet-2017-0034](https://doi.org/10.1515/jnet-2017-0034).
//! - I. Romero (2009), *Thermodynamically consistent time-stepping algorithms for non-linear
//!   thermomechanical systems*, [doi:10.1002/nme.2588](https://doi.org/10.1002/nme.2588): both laws by two
//!   discrete gradients, on a flat space.
//! - X. Shang, H. C. Öttinger (2020), *Structure-preserving integrators for dissipative systems based on
//!   reversible-irreversible splitting*,
//!   [doi:10.1098/rspa.2019.0446](https://doi.org/10.1098/rspa.2019.0446): the gas containers.
