//! The equations of the paper, the code that computes each, and the test that checks it.
//!
//! The paper is A. Bloch, M. Farré Puiggalí and D. Martín de Diego, *Metriplectic Euler-Poincaré equations:
//! smooth and discrete dynamics* ([arXiv:2401.05220](https://arxiv.org/abs/2401.05220)). The rows follow the
//! order and the headings of the paper. A labelled equation is named by its label. `†` marks an equation that differs
//! from the printed one; its derivation is on the page [`errata`](super::errata). A test is given by its file and name.
//! Another test checks that each of them exists
//! (`tests/equations.rs::every_test_that_the_guide_names_exists`). A row says so if the library lacks the equation.
//!
//! # §1 Introduction
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | `x' = Π(x) ∇H(x)`, `Π` skew, not necessarily Poisson | [`AlmostPoisson::field`](crate::dynamics::AlmostPoisson::field); of every other [`Bracket`](crate::dynamics::Bracket) the Jacobi identity is asked, and [`report`](crate::dynamics::Verify::report) has its defect | `tests/nonholonomic.rs::the_sleigh_follows_its_closed_form_to_second_order_and_keeps_its_energy`, `tests/nonholonomic.rs::the_jacobi_identity_is_reported_and_not_asked_for` |
//! | `x' − x = h Π̄ ∇̄H` † | [`Scheme`](crate::integrators::Scheme), by [`Stepper::step`](crate::integrators::Stepper::step) | `tests/errata.rs::a_step_without_its_size_is_a_step_of_size_one` |
//!
//! # §2.1 Poisson structures
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | skew-symmetry, Leibniz, Jacobi for `{f, g}` | [`laws::bracket`](crate::dynamics::laws::bracket), on samples in every [`report`](crate::dynamics::Verify::report) | `tests/laws.rs::lie_poisson_brackets_keep_the_laws`, `tests/laws.rs::brackets_of_a_volume_form_keep_the_laws`, `tests/laws.rs::constant_and_closure_brackets_keep_the_laws` |
//! | `X_f(g) = {g, f}`, `X_f = Π^{ij} f_j ∂_i` | [`VectorField::velocity`](crate::dynamics::VectorField::velocity) | `tests/equations.rs::a_hamiltonian_vector_field_is_the_bracket_with_the_energy` |
//! | `{f, g} = Π(df, dg) = Π^{ij} f_i g_j` | [`Bracket::tensor`](crate::dynamics::Bracket::tensor) | `tests/equations.rs::a_hamiltonian_vector_field_is_the_bracket_with_the_energy` |
//! | `[Π, Π] = 0`; `Π^{il} ∂_l Π^{jk} + cyclic = 0` | [`laws::bracket`](crate::dynamics::laws::bracket), law 2; for structure constants [`LieAlgebra::new`](crate::manifolds::LieAlgebra::new) | `tests/laws.rs::random_antisymmetric_constants_break_the_jacobi_identity`, `crates/manifolds/src/lie_dual.rs::ready_made_algebras_pass_the_checks` |
//! | `Π = ½ Π^{ij} ∂_i ∧ ∂_j` † | the matrix `Π^{ij}` itself, [`Poisson::field`](crate::dynamics::Poisson::field) | `tests/errata.rs::a_double_sum_over_wedges_counts_every_bracket_twice` |
//! | `♯_Π(α) = Π(·, α)` | [`Bracket::apply`](crate::dynamics::Bracket::apply) | `tests/laws.rs::each_law_of_a_bracket_can_break` |
//! | (hamil-eq) `x' = X_H(x) = ♯_Π(dH)` | a [`System`](crate::dynamics::System) without an entropy | `tests/order.rs::the_free_body_is_integrated_to_second_order`, `tests/reference.rs::the_free_body_extrapolated_to_no_step_follows_its_elliptic_functions` |
//! | `{f, H} = 0`, first integrals; `{H, H} = 0` | listed by [`momentum`](crate::dynamics::SystemBuilder::momentum), and then checked and kept | `tests/equations.rs::a_hamiltonian_vector_field_is_the_bracket_with_the_energy`, `tests/errata.rs::a_momentum_is_kept_if_its_differential_is_annihilated` |
//! | Casimirs, `{C, g} = 0` for all `g` | `Π dS = 0`, in every [`verify`](crate::dynamics::Verify::verify) | `tests/laws.rs::the_casimirs_of_se3_are_entropies_and_the_angular_momentum_is_not` |
//! | the rank of `Π` is even | not computed | — |
//!
//! # §2.2 Positive semidefinite inner products
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | `♯_K(α) = K(α, ·)`, `grad^K S = ♯_K(dS)` | [`Dissipation::apply`](crate::dynamics::Dissipation::apply) | `tests/laws.rs::each_law_of_a_dissipation_can_break` |
//! | `(f, g) = K(df, dg) = K^{ij} f_i g_j`, symmetric, `⪰ 0` | [`Dissipation::tensor`](crate::dynamics::Dissipation::tensor), [`laws::dissipation`](crate::dynamics::laws::dissipation) | `tests/laws.rs::the_metric_dissipation_keeps_the_laws` |
//! | `G*(df, dg) = G(grad f, grad g)` | [`InnerProduct`](crate::manifolds::InnerProduct), [`Riemannian`](crate::manifolds::Riemannian) | `crates/manifolds/src/laws/tests.rs::flat_spaces_keep_the_laws`, `tests/metrics.rs::metrics_that_vary_keep_the_laws_on_rotations_and_products` |
//! | (semid) `K(α, β) = G*(dH,dH) G*(α,β) − G*(dH,α) G*(dH,β)`, both lines | [`MetricDissipation`](crate::dynamics::MetricDissipation) | `tests/equations.rs::the_form_of_the_metric_is_the_printed_one_on_each_line` |
//! | `K^{ij} = C_H g^{ij} − (g⁻¹dH)^i (g⁻¹dH)^j` | the same | `tests/equations.rs::the_form_of_the_metric_is_the_printed_one_on_each_line` |
//! | remark: `K(α, β) = G*(Qα, Qβ)` off all `dL_a` † | [`SystemBuilder::casimir`](crate::dynamics::SystemBuilder::casimir), [`momentum`](crate::dynamics::SystemBuilder::momentum), with the scale `G*(dH, dH)` | `tests/errata.rs::the_remark_has_another_scale_than_the_equation_before_it`, `tests/errata.rs::a_momentum_is_kept_if_its_differential_is_annihilated` |
//!
//! # §2.3 Metriplectic systems
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | `{f, g} = ⟨df, ♯_Π(dg)⟩`, `(f, g) = ⟨df, ♯_K(dg)⟩` | [`Bracket::apply`](crate::dynamics::Bracket::apply), [`Dissipation::apply`](crate::dynamics::Dissipation::apply) | `tests/equations.rs::a_hamiltonian_vector_field_is_the_bracket_with_the_energy`, `tests/equations.rs::the_form_of_the_metric_is_the_printed_one_on_each_line` |
//! | `♯_K(dH) = 0` | [`verify`](crate::dynamics::Verify::verify), and by construction for every [`Dissipation`](crate::dynamics::Dissipation) | `tests/laws.rs::each_law_of_a_dissipation_can_break` |
//! | `♯_Π(dS) = 0` | [`verify`](crate::dynamics::Verify::verify) | `tests/bad_input.rs::an_entropy_that_is_no_casimir_is_refused_unless_the_published_scheme_is_asked_for` |
//! | `x' = ♯_Π(dE) + ♯_K(dE)`, `E = H + S` | `H` and `S` are kept apart; it is the same velocity | `tests/equations.rs::the_equations_of_motion_have_both_laws` |
//! | `x' = X_H + grad^K S` | [`System`](crate::dynamics::System), [`VectorField::velocity`](crate::dynamics::VectorField::velocity) | `tests/equations.rs::the_equations_of_motion_have_both_laws` |
//! | first law, `H' = {H, H} + (H, S) = 0` | [`Certificate::keeps_energy`](crate::integrators::Certificate::keeps_energy) | `tests/equations.rs::the_equations_of_motion_have_both_laws`, `tests/problems.rs::the_energy_is_kept_where_a_step_spans_two_radians` |
//! | second law, `S' = (S, S) ≥ 0` | [`Certificate::keeps_entropy`](crate::integrators::Certificate::keeps_entropy) | `tests/equations.rs::the_equations_of_motion_have_both_laws` |
//! | `x'^i = Π^{ij} H_j + K^{ij} S_j`; (matricial) `x' = Π∇H + K∇S` | [`VectorField::velocity`](crate::dynamics::VectorField::velocity) | `tests/equations.rs::the_equations_of_motion_have_both_laws`, `tests/problems.rs::the_velocity_of_each_problem_is_the_one_by_hand` |
//!
//! # §2.4 Symmetry preservation
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | the action `Φ`, `Φ_e = 1`, `Φ_g Φ_h = Φ_{gh}`; `ξ_P(x) = d/dt exp(tξ)·x` | [`SystemBuilder::symmetry`](crate::dynamics::SystemBuilder::symmetry), one closure `(t, x)` for each one-parameter group `exp(tξ)` | `tests/equations.rs::an_action_is_checked_against_bracket_energy_and_momentum_map` |
//! | Poisson actions, `Φ_g^*{f, h} = {Φ_g^* f, Φ_g^* h}` | [`SystemBuilder::symmetry`](crate::dynamics::SystemBuilder::symmetry), checked as `T Π(x) Tᵀ = Π(Φ(x))` | `tests/equations.rs::an_action_is_checked_against_bracket_energy_and_momentum_map` |
//! | momentum maps, `X_{J_ξ} = ξ_P`, `{f, J_ξ} = ξ_P(f)` | [`SystemBuilder::symmetry`](crate::dynamics::SystemBuilder::symmetry), checked as `Π dJ_ξ = dΦ_t/dt` | `tests/equations.rs::an_action_is_checked_against_bracket_energy_and_momentum_map`, `tests/errata.rs::the_momentum_of_a_body_is_a_covector_and_its_velocity_is_not_kept` |
//! | `H∘Φ_g = H` makes `J_ξ` a first integral | [`SystemBuilder::momentum`](crate::dynamics::SystemBuilder::momentum), kept to round-off | `tests/errata.rs::a_momentum_is_kept_if_its_differential_is_annihilated` |
//! | `(f, J_ξ) = 0`, `♯_K(dJ_ξ) = 0` † | by projection for [`MetricDissipation`](crate::dynamics::MetricDissipation); required of any other dissipation | `tests/errata.rs::a_momentum_is_kept_if_its_differential_is_annihilated` |
//! | `dJ_ξ/dt = {J_ξ, H} + (J_ξ, S) = 0` | the same | `tests/errata.rs::a_momentum_is_kept_if_its_differential_is_annihilated` |
//! | `P = T*G`, `Ψ_g = T*L_{g⁻¹}` † | [`Symplectic`](crate::dynamics::Symplectic) on `Product<Rotations, Euclidean<3>>` | `tests/errata.rs::the_pull_back_by_a_left_translation_acts_from_the_right`, `tests/errata.rs::before_reduction_the_entropy_is_no_casimir_and_a_function_of_the_momentum` |
//!
//! # §3 Forced Euler-Poincaré equations and metriplectic dynamics
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | (el) `d/dt (∂l/∂ξ) = ad*_ξ ∂l/∂ξ` | [`LiePoisson`](crate::dynamics::LiePoisson) with [`SystemBuilder::lagrangian`](crate::dynamics::SystemBuilder::lagrangian) | `tests/euler_poincare.rs::a_nonquadratic_lagrangian_follows_the_equations_in_velocities_to_second_order` |
//! | `⟨ad*_ξ α, ξ'⟩ = ⟨α, [ξ, ξ']⟩` | [`LieAlgebra::coadjoint`](crate::manifolds::LieAlgebra::coadjoint) | `crates/manifolds/src/lie_dual.rs::coadjoint_is_the_transpose_of_the_bracket` |
//! | `E_l = ⟨∂l/∂ξ, ξ⟩ − l`, `E_l' = 0` | [`Legendre`](crate::dynamics::Legendre) | `crates/dynamics/src/legendre.rs::a_quadratic_lagrangian_has_a_quadratic_energy`, `tests/euler_poincare.rs::the_relaxed_rigid_body_of_a_lagrangian_relaxes_and_keeps_both_laws` |
//! | `F(ξ) = ad*_ξ 𝓕(ξ)` †, `𝓕` arbitrary | [`SystemBuilder::force`](crate::dynamics::SystemBuilder::force), [`Force`](crate::dynamics::Force) | `tests/errata.rs::a_force_turned_by_another_velocity_does_work`, `tests/conservation.rs::the_energy_of_a_forced_body_is_conserved_over_a_hundred_thousand_steps` |
//! | (fel) `d/dt (∂l/∂ξ) = ad*_ξ (∂l/∂ξ + 𝓕)` | [`euler_poincare`](crate::dynamics::euler_poincare), with a [`force`](crate::dynamics::SystemBuilder::force) or that of a [`CasimirDissipation`](crate::dynamics::CasimirDissipation) | `tests/forces.rs::the_force_on_a_lagrangian_that_is_not_quadratic_is_integrated_to_second_order`, `tests/equations.rs::forced_euler_poincare_equations_in_a_basis`, `tests/euler_poincare.rs::a_nonquadratic_lagrangian_relaxes_on_se3_and_so4` |
//! | (fel2) `d/dt (∂l/∂ξ^b) = C_ab^d ξ^a (∂l/∂ξ^d + 𝓕_d)`, `[e_a, e_b] = C_ab^d e_d` | [`LieAlgebra`](crate::manifolds::LieAlgebra), [`StructureConstant`](crate::manifolds::lie_dual::StructureConstant) | `tests/equations.rs::forced_euler_poincare_equations_in_a_basis`, `tests/laws.rs::the_dual_of_an_algebra_in_a_random_basis_keeps_the_laws` |
//! | example: `(IΩ)' = IΩ × Ω + 𝓕 × Ω`, in components | [`LieDual::so3`](crate::manifolds::LieDual::so3) | `tests/equations.rs::the_forced_rigid_body_in_components` |
//! | (flp) `μ' = ad*_{dH} (μ + 𝓕(dH))`, `H = ⟨μ, ξ(μ)⟩ − l(ξ(μ))`, `μ = ∂l/∂ξ` | [`ForcedLiePoisson`](crate::dynamics::ForcedLiePoisson); [`Legendre`](crate::dynamics::Legendre), [`Legendre::momentum`](crate::dynamics::Legendre::momentum), [`Legendre::velocity`](crate::dynamics::Legendre::velocity) | `tests/forces.rs::a_force_of_no_form_is_integrated_to_second_order`, `tests/forces.rs::an_arbitrary_force_keeps_the_energy_on_se3`, `crates/dynamics/src/legendre.rs::the_velocity_undoes_the_momentum`, `tests/euler_poincare.rs::a_step_of_the_relaxed_rigid_body_is_the_same_from_its_lagrangian_and_from_the_metric` |
//! | (cas) `C' = ⟨𝓕(dH), [dH, dC]⟩`; in a step `ΔC = h ⟨𝓕(w_H), [w_H, w_C]⟩` | the same, [`CasimirDissipation::force`](crate::dynamics::CasimirDissipation::force) | `tests/forces.rs::a_casimir_changes_by_its_formula_in_each_step`, `tests/equations.rs::a_casimir_grows_by_the_power_of_the_force` |
//! | example: `C'` in components, the force `𝓕(Ω) = Ω × IΩ` | [`CasimirDissipation::force`](crate::dynamics::CasimirDissipation::force) with `κ = 1` | `tests/equations.rs::a_casimir_grows_by_the_power_of_the_force` |
//! | the relaxed rigid body in components | [`MetricDissipation`](crate::dynamics::MetricDissipation) or [`CasimirDissipation`](crate::dynamics::CasimirDissipation) | `tests/equations.rs::the_relaxed_rigid_body_in_components` |
//! | (sem) a form `κ` on `g` † | [`CasimirDissipation::new`](crate::dynamics::CasimirDissipation::new) | `tests/errata.rs::the_form_on_the_algebra_is_not_the_form_on_covectors`, `crates/dynamics/src/dissipation/casimir.rs::a_form_that_is_not_semidefinite_is_refused_with_its_number` |
//! | (ops1) `⟨𝓕(ξ), η⟩ = κ(η, [ξ, dC])` | [`CasimirDissipation::force`](crate::dynamics::CasimirDissipation::force) | `tests/equations.rs::a_casimir_grows_by_the_power_of_the_force`, `tests/equations.rs::dissipations_beside_that_of_the_metric_keep_the_laws` |
//! | `⟨𝓕(ξ), [ξ, dC]⟩ ≥ 0` makes `C` an entropy | checked for every force: [`verify`](crate::dynamics::Verify::verify) | `tests/forces.rs::a_force_of_the_right_sign_has_the_second_law_exactly`, `tests/forces.rs::a_force_under_which_the_entropy_falls_is_refused_unless_the_second_law_is_not_promised` |
//! | `C' = κ([dH, dC], [dH, dC]) ≥ 0` | [`CasimirDissipation`](crate::dynamics::CasimirDissipation) | `tests/equations.rs::a_casimir_grows_by_the_power_of_the_force` |
//!
//! # §4.1 Discrete gradient systems
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | `H' = ∇HᵀΠ∇H = 0` | [`Bracket`](crate::dynamics::Bracket) | `tests/laws.rs::each_law_of_a_bracket_can_break` |
//! | (discGrad) `∇̄H·(x' − x) = ΔH`, `∇̄H(x, x) = ∇H(x)` | [`laws::discrete_gradient`](crate::integrators::laws::discrete_gradient) | `crates/integrators/src/laws.rs::the_discrete_gradient_keeps_its_laws` |
//! | (AVF) `∫₀¹ ∇H((1−ξ)x + ξx') dξ` | [`MeanValue`](crate::integrators::MeanValue) | `tests/equations.rs::three_discrete_gradients_are_the_printed_ones`, `crates/integrators/src/laws.rs::the_discrete_gradient_keeps_its_laws` |
//! | (gonzalez) `∇H(z) + (ΔH − ∇H(z)·d) d/\|d\|²` | [`Gonzalez`](crate::integrators::Gonzalez); safe against round-off, [`StableGradient`](crate::integrators::StableGradient) | `tests/equations.rs::three_discrete_gradients_are_the_printed_ones`, `crates/integrators/src/round_off/stable_gradient.rs::the_covector_keeps_its_digits_on_short_arcs` |
//! | (itoAbe) quotients, one coordinate after another | [`ItohAbe`](crate::integrators::ItohAbe); symmetrised, [`SymmetricItohAbe`](crate::integrators::SymmetricItohAbe) | `tests/equations.rs::three_discrete_gradients_are_the_printed_ones`, `crates/integrators/src/laws.rs::the_discrete_gradient_keeps_its_laws` |
//!
//! # §4.2 Construction of metriplectic or generic integrators
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | (ops) `(x' − x)/h = Π(z) ∇̄₂H + K_d(z) ∇S(z)` | [`Scheme`](crate::integrators::Scheme), [`Residual`](crate::integrators::Residual) | `tests/reference.rs::one_step_of_the_rigid_body_is_the_published_one`, `tests/order.rs::a_heavy_top_is_integrated_to_the_order_of_the_retraction` |
//! | `x_k = φ(x_{k−1}, h)`, for `h ≤ h̄` | [`Steps`](crate::integrators::Steps); a step that is not solved is split in halves | `tests/problems/every_method.rs::every_method_keeps_its_promises_on_every_problem`, `tests/conservation.rs::steps_far_too_large_keep_the_energy` |
//! | second law, `ΔS ≥ −C h³` † | [`SecondLaw::Published`](crate::dynamics::SecondLaw::Published) | `tests/errata.rs::the_published_scheme_lowers_the_entropy_and_by_third_order_only` |
//! | (semid-d) `K_d(α, β) = G*(w,w) G*(α,β) − G*(w,α) G*(w,β)` † | [`MetricDissipation`](crate::dynamics::MetricDissipation), told to annihilate `w` | `tests/errata.rs::the_factor_in_the_discrete_form_makes_another_equation_of_it` |
//! | first law, `H(x_{k+1}) = H(x_k)` | [`laws::step`](crate::integrators::laws::step) | `crates/integrators/src/laws.rs::a_midpoint_step_is_symmetric_and_keeps_the_energy`, `tests/conservation.rs::a_million_steps_of_the_relaxing_body_keep_the_energy`, `tests/conservation.rs::a_million_steps_of_a_heavy_body_keep_energy_and_orthogonality` |
//!
//! # §4.3 Example: the relaxing rigid body
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | `I₁Ω₁' = (I₂ − I₃)Ω₂Ω₃`, … | [`LieDual::so3`](crate::manifolds::LieDual::so3) | `tests/equations.rs::the_forced_rigid_body_in_components` |
//! | `l = ½ Σ I_i Ω_i²` †, `p_i = ∂l/∂Ω_i = I_iΩ_i` | [`Legendre::momentum`](crate::dynamics::Legendre::momentum) | `tests/errata.rs::a_lagrangian_without_its_brackets_has_twice_the_momenta` |
//! | `p₁' = (I₂ − I₃)/(I₂I₃) p₂p₃`, …; `p' = Π∇H`, `Π = hat(p)` † | [`LiePoisson`](crate::dynamics::LiePoisson) | `tests/errata.rs::a_tensor_of_velocities_and_momenta_is_not_the_bracket_of_the_body` |
//! | `H = ½ Σ p_i²/I_i`, `S = ½\|p\|²` | closures | `tests/reference.rs::the_relaxing_body_comes_to_rest_on_its_axis_of_largest_inertia` |
//! | the matrix `K`; `p' = Π∇H + K∇S` in components | [`MetricDissipation`](crate::dynamics::MetricDissipation) | `tests/equations.rs::the_relaxed_rigid_body_in_components`, `tests/reference.rs::the_relaxing_body_extrapolated_to_no_step_is_its_exact_flow` |
//! | `Π∇S = 0`, `K∇H = 0` | [`verify`](crate::dynamics::Verify::verify) | `tests/equations.rs::the_equations_of_motion_have_both_laws` |
//! | `∇̄₂H(p, P) = (z₁/I₁, z₂/I₂, z₃/I₃)` † | [`Gonzalez`](crate::integrators::Gonzalez) | `tests/errata.rs::a_discrete_gradient_is_a_function_of_two_points` |
//! | `K_d` and the midpoint rule in components | [`WeylMidpoint`](crate::manifolds::WeylMidpoint) on [`LieDual`](crate::manifolds::LieDual) | `tests/equations.rs::a_step_solves_the_printed_midpoint_rule` |
//! | `∇S(z) = ∇̄₂S(p, P)`, `ΔS ≥ 0`, `ΔH = 0` | [`Certificate`](crate::integrators::Certificate) | `tests/equations.rs::the_example_relaxes_with_both_laws`, `tests/conservation.rs::the_entropy_falls_on_no_step_by_more_than_its_round_off` |
//! | figure: `I = (10, 5, 1)`, `h = 0.1`, `p = (0.001, −1, 0.001)` | `examples/relaxing_rigid_body.rs` | `tests/examples.rs::the_relaxing_rigid_body_prints_one_object` |
//!
//! # §4.4 Extension to differentiable manifolds
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | `R_h: TP → P × P`, `R_h⁻¹`, `z = τ_P(R_h⁻¹(x, x')) ∈ P` † | [`Retraction`](crate::manifolds::Retraction), [`Tangent`](crate::manifolds::Tangent) | `crates/manifolds/src/laws/tests.rs::metrics_that_vary_keep_the_laws`, `tests/errata.rs::the_base_of_a_pair_is_a_point_and_not_a_vector` |
//! | `exp_h(v) = (x, exp_x(hv))` | [`Exponential`](crate::manifolds::Exponential) | `tests/equations.rs::both_retractions_are_the_printed_pairs` |
//! | `exp_x(v) = γ_v(1)`, geodesics of `G` | [`Riemannian::exp`](crate::manifolds::Riemannian::exp), [`Riemannian::log`](crate::manifolds::Riemannian::log) | `tests/metrics.rs::geodesics_of_a_left_invariant_metric_are_euler_s_rigid_body`, `crates/manifolds/src/field_metric.rs::geodesics_of_the_half_plane_are_its_semicircles` |
//! | (weyl) `(exp_z(−hv/2), exp_z(hv/2))` | [`WeylMidpoint`](crate::manifolds::WeylMidpoint) | `tests/equations.rs::both_retractions_are_the_printed_pairs`, `tests/reference.rs::the_spinning_top_has_the_published_errors` |
//! | second order † | [`WeylMidpoint`](crate::manifolds::WeylMidpoint) 2, [`Exponential`](crate::manifolds::Exponential) 1 | `tests/errata.rs::the_exponential_at_the_start_is_of_first_order`, `tests/examples.rs::the_convergence_study_prints_an_array_of_orders` |
//! | the diagram `π_P ∘ ∇̄H = τ_P ∘ R_h⁻¹` | covectors of a step are at the base `z` of its [`StepPath`](crate::manifolds::StepPath) | `crates/manifolds/src/laws/tests.rs::metrics_that_vary_keep_the_laws` |
//! | (discGrad-m) `h⟨w, v⟩ = ΔH` †, `w → dH` | [`laws::discrete_gradient`](crate::integrators::laws::discrete_gradient) | `crates/integrators/src/laws.rs::the_discrete_gradient_keeps_its_laws`, `tests/errata.rs::a_discrete_gradient_on_a_manifold_counts_the_step` |
//! | (gonzalez-m) `w = dH(z) + (ΔH/h − dH(z)v) ♭v/G(v,v)` † | [`Gonzalez`](crate::integrators::Gonzalez) | `tests/errata.rs::a_discrete_gradient_on_a_manifold_counts_the_step`, `tests/covariance.rs::a_step_on_the_sphere_is_the_same_in_colatitude_and_longitude` |
//! | `♭(u)(v) = G(u, v)` | [`InnerProduct::flat`](crate::manifolds::InnerProduct::flat) | `crates/manifolds/src/laws/tests.rs::flat_spaces_keep_the_laws` |
//! | `R_h⁻¹(x_k, x_{k+1}) = Π(z) w + K_d(z) dS(z)` † | [`Scheme`](crate::integrators::Scheme), [`Residual`](crate::integrators::Residual), [`Method`](crate::integrators::Method) | `tests/reference.rs::one_step_of_pure_relaxation_on_the_sphere_is_the_published_one`, `tests/reference.rs::one_step_on_the_rotation_group_is_the_published_one`, `tests/errata.rs::the_dissipation_acts_on_the_differential_and_not_on_the_gradient` |
//!
//! # Beyond the paper
//!
//! | equation | in the library | checked by |
//! |---|---|---|
//! | exact scheme, `v = P Π Pᵀ w_H + K_{w_H} w_S`, `ΔS = h K(w_S, w_S) ≥ 0` | [`SecondLaw::Exact`](crate::dynamics::SecondLaw::Exact), [`velocity`](crate::dynamics::velocity) | `tests/second_law.rs::two_gas_containers_lose_entropy_by_the_published_scheme_and_never_by_the_exact_one`, `tests/second_law.rs::two_gas_containers_follow_their_exact_flow` |
//! | Nambu, `ε^{ijk} S_j H_k/√det g`; area form, `−ε^{ij} H_j/√det g` | [`Nambu`](crate::dynamics::Nambu), [`AreaForm`](type@crate::dynamics::AreaForm) | `tests/laws.rs::brackets_of_a_volume_form_keep_the_laws`, `tests/covariance.rs::a_nambu_step_on_rotations_is_the_same_in_rotation_vectors` |
//! | with `n − 2` Casimirs, `det[dC_1, …, dC_{n−2}, dH, eⁱ]/√det g` | [`Nambu`](crate::dynamics::Nambu) | `tests/laws.rs::brackets_with_several_casimirs_keep_the_laws`, `tests/invariants.rs::the_velocity_of_a_bracket_with_two_casimirs_is_the_cross_product_of_the_space_around` |
//! | Kulkarni-Nomizu product of two forms (Morrison and Updike 2024) | [`KulkarniNomizu`](crate::dynamics::KulkarniNomizu) | `tests/equations.rs::dissipations_beside_that_of_the_metric_keep_the_laws` |
//! | `K(x, w)` from a closure; a semidefinite cometric; a scale `κ(x)` | [`FieldDissipation`](crate::dynamics::FieldDissipation), [`CometricDissipation`](crate::dynamics::CometricDissipation), [`Scaled`](crate::dynamics::Scaled) | `tests/dissipations.rs::a_closure_of_the_annihilated_covector_damps_an_oscillator_as_its_closed_form`, `tests/dissipations.rs::a_scaled_dissipation_relaxes_a_symmetric_body_on_time` |
//! | `hv = 2 tan(θ/2)` on Sⁿ, `4 tan(θ/4)` on SO(3) | [`Projection`](crate::manifolds::Projection), [`Cayley`](crate::manifolds::Cayley) | `crates/manifolds/src/projection.rs::the_projection_of_the_sphere_keeps_the_laws`, `crates/manifolds/src/cayley.rs::the_cayley_retraction_keeps_the_laws` |
