//! The text by which an open flow around points is a flow: for explicit methods, and for implicit ones.

/// Makes an [`OpenFlow`](crate::open::OpenFlow) around the flow `$closed` a flow for explicit and implicit methods.
#[doc(hidden)]
#[macro_export]
macro_rules! open_flow {
    ([$($generics:tt)*] $flow:ty: $closed:ty, weighs errors: $weighs:expr, catches panics: $catches:expr $(, $visit:ident)?) => {
        impl<$($generics)*> $crate::Listed for $flow {
            const CATCHES_PANICS: bool = $catches;

            /// A ledger without entries.
            type Layout = $crate::open::Ledger;

            fn layout(&self) -> &Self::Layout {
                $crate::open::OpenFlow::empty(self)
            }

            fn read(empty: &Self::Layout, entries: &[f64]) -> $crate::Element<Self> {
                let (points, rest) = entries.split_at(entries.len() - 1 - empty.numbers().len());
                $crate::OpenState {
                    x: <$closed as $crate::Listed>::read(&(), points),
                    time: rest[0],
                    ledger: empty.with_numbers(&rest[1..]),
                }
            }

            fn at_start(
                &self,
                entries: &[f64],
            ) -> Result<$crate::Element<Self>, metriplectic_manifolds::PointError> {
                match $crate::open::OpenFlow::at(self, 0.0).element(entries) {
                    Err(metriplectic_manifolds::PointError::Length { .. }) => self.element(entries),
                    points => points.map(|x| self.start(x)),
                }
            }

            fn led(x: &$crate::Element<Self>, y: $crate::Element<Self>) -> $crate::Element<Self> {
                x.at(y.x)
            }

            fn write(x: &$crate::Element<Self>) -> $crate::Entries {
                <<Self as $crate::Flow>::Space as $crate::StateSpace>::numbers(x).into()
            }
        }

        impl<$($generics)*> $crate::Flow for $flow {
            type Space = $crate::OpenSpace<<$closed as $crate::Flow>::Space>;
            type Numbers = <$closed as $crate::Flow>::Numbers;
            type Vector = $crate::open::Beside<<$closed as $crate::Flow>::Vector>;

            fn laws(&self, x: &$crate::Element<Self>) -> $crate::Laws<Self::Numbers> {
                x.ledger.balanced($crate::open::OpenFlow::at(self, x.time).laws(&x.x))
            }

            fn term_sizes(&self, x: &$crate::Element<Self>) -> $crate::Laws<Self::Numbers> {
                let sizes = $crate::open::OpenFlow::at(self, x.time).term_sizes(&x.x);
                let energy = sizes.energy + x.ledger.net().abs();
                let entropy = sizes.entropy + x.ledger.entropy_of_baths().abs();
                $crate::Laws { energy, entropy, ..sizes }
            }

            fn entropy_round_off(&self, ends: [&$crate::Element<Self>; 2]) -> f64 {
                let of_baths = ends.map(|x| x.ledger.entropy_of_baths().abs());
                $crate::open::OpenFlow::at(self, ends[1].time)
                    .entropy_round_off(ends.map(|x| &x.x))
                    + 4.0 * f64::EPSILON * of_baths[0].max(of_baths[1])
            }

            fn energy_sizes(&self, ends: [&$crate::Element<Self>; 2]) -> [f64; 2] {
                // What flows in may find a state without energy.
                let flowed = ends[1].ledger.flowed(&ends[0].ledger)
                    + $crate::open::OpenFlow::frozen_work(self, ends.map(|x| x.time), &ends[0].x).abs();
                ends.map(|x| self.term_sizes(x).energy + flowed)
            }

            fn rates(&self, x: &$crate::Element<Self>, d: &Self::Vector) -> Option<Self::Vector> {
                let y = $crate::StageFlow::stage(self, x, d)?;
                let (v, _) = $crate::StageFlow::motion(self, &y)?;
                Some($crate::StageFlow::stage_rates(self, x, (d, &y), &v))
            }

            fn sizes(&self, x: &$crate::Element<Self>) -> Self::Vector {
                let mut beside = vec![0.0];
                beside.extend(x.ledger.entry_sizes());
                let v = $crate::open::OpenFlow::at(self, x.time).sizes(&x.x);
                $crate::open::Beside { v, beside }
            }

            fn moved(&self, x: &$crate::Element<Self>, d: &Self::Vector) -> $crate::Element<Self> {
                let point = $crate::open::OpenFlow::at(self, x.time).moved(&x.x, &d.v);
                $crate::open::surrounded::advanced(self, x, &d.beside, point)
            }

            fn displacement(
                &self,
                x: &$crate::Element<Self>,
                y: &$crate::Element<Self>,
            ) -> Option<Self::Vector> {
                let v = $crate::open::OpenFlow::at(self, x.time).displacement(&x.x, &y.x)?;
                Some($crate::open::Beside { v, beside: $crate::open::surrounded::between(self, x, y) })
            }

            fn production(&self, x: &$crate::Element<Self>) -> Option<f64> {
                Some($crate::StageFlow::motion(self, x)?.1)
            }

            fn onto(
                &self,
                y: &$crate::Element<Self>,
                laws: &$crate::Laws<Self::Numbers>,
                entropy: Option<f64>,
            ) -> Option<$crate::Element<Self>> {
                use $crate::explicit::{Combination, Target};
                let laws =
                    $crate::Laws { entropy: entropy.unwrap_or(laws.entropy), ..laws.clone() };
                let motion = $crate::StageFlow::motion(self, y).map(|(v, _)| v);
                let weighs = <Self as $crate::StageFlow>::WEIGHS_ERRORS;
                let terms = [(1.0, motion.as_ref()?)];
                let error = weighs.then_some(Combination { factor: 1.0, terms: &terms });
                let with_entropy = entropy.is_some();
                let target = Target { laws: &laws, with_entropy, limit: None, units: None, error };
                $crate::StageFlow::project(self, y.clone(), &target).ok().map(|end| end.x)
            }

            fn element(
                &self,
                entries: &[f64],
            ) -> Result<$crate::Element<Self>, metriplectic_manifolds::PointError> {
                $crate::open::surrounded::element(self, entries)
            }

            fn begin(
                &self,
                x: $crate::Element<Self>,
                time: f64,
            ) -> Result<$crate::Element<Self>, $crate::StartError> {
                x.begun(time, $crate::open::OpenFlow::empty(self))
            }

            fn clocked(&self, x: &$crate::Element<Self>, time: f64) -> Option<$crate::Element<Self>> {
                $crate::open::surrounded::clocked(self, x, time)
            }

            fn jumped(
                &self,
                x: &$crate::Element<Self>,
                y: $crate::Element<Self>,
            ) -> $crate::Element<Self> {
                x.at(y.x)
            }

            fn with_event(
                &self,
                x: &$crate::Element<Self>,
                event: &$crate::EventExchange,
            ) -> Option<$crate::Element<Self>> {
                Some($crate::OpenState { ledger: x.ledger.with_event(event), ..x.clone() })
            }

            fn depends_on_time(&self) -> bool {
                true
            }

            fn ledger(&self, x: &$crate::Element<Self>) -> Option<$crate::LedgerSummary> {
                let runs = $crate::open::OpenFlow::has_clock(self);
                let parameter = runs.then(|| x.ledger.parameter_work());
                Some(x.ledger.summarised(parameter, self.entropy_at(x)))
            }

            fn has_ledger(&self) -> bool {
                true
            }

            fn ledger_errors(&self, errors: &Self::Vector) -> Option<$crate::LedgerErrors> {
                Some($crate::open::OpenFlow::empty(self).errors_by_kind(&errors.beside[1..]))
            }

            fn with_ledger_sizes(
                &self,
                x: &$crate::Element<Self>,
                scales: $crate::Scales<Self::Vector>,
            ) -> $crate::Scales<Self::Vector> {
                $crate::open::surrounded::with_ledger_sizes(self, x, scales)
            }

            fn inspect(
                &self,
                ends: [&$crate::Element<Self>; 2],
                of_one_size: bool,
            ) -> Result<(), $crate::StepError> {
                $crate::open::surrounded::inspect(self, ends, of_one_size)
            }

            fn entropy_law(&self) -> metriplectic_dynamics::SecondLaw {
                use metriplectic_dynamics::SecondLaw;
                match $crate::open::OpenFlow::at(self, 0.0).entropy_law() {
                    _ if $crate::open::OpenFlow::has_cold_bath(self) => SecondLaw::Published,
                    SecondLaw::NoEntropy
                        if $crate::open::OpenFlow::empty(self).heats().next().is_some() =>
                    {
                        SecondLaw::Exact
                    }
                    law => law,
                }
            }

            fn evaluated(&self, x: &$crate::Element<Self>) -> Vec<metriplectic_equations::Evaluated> {
                $crate::open::OpenFlow::at(self, 0.0).evaluated(&x.x)
            }

            fn kinds(&self) -> Vec<metriplectic_dynamics::invariants::Kind> {
                $crate::open::OpenFlow::at(self, 0.0).kinds()
            }

            fn check(&self, x0: &$crate::Element<Self>) -> Result<(), metriplectic_dynamics::ModelError> {
                $crate::open::OpenFlow::check_points(self, x0)?;
                $crate::open::OpenFlow::check_clock(self, x0)?;
                $crate::open::OpenFlow::check_exchange(self, x0)
            }

            fn examine(&self, x0: &$crate::Element<Self>) -> Result<(), $crate::FlowError> {
                $crate::open::OpenFlow::examine_points(self, x0)
            }

            fn is_verified(&self) -> bool {
                $crate::open::OpenFlow::was_verified(self)
            }

            fn rechecks(&self, occasion: $crate::Recheck) -> bool {
                $crate::open::OpenFlow::at(self, 0.0).rechecks(occasion)
            }

            fn recheck(
                &self,
                x: &$crate::Element<Self>,
                occasion: $crate::Recheck,
            ) -> Result<(), metriplectic_dynamics::ModelError> {
                if occasion == $crate::Recheck::End {
                    $crate::open::OpenFlow::check_clock(self, x)?;
                }
                $crate::open::OpenFlow::at(self, x.time).recheck(&x.x, occasion)
            }

            fn reexamine(
                &self,
                x: &$crate::Element<Self>,
                occasion: $crate::Recheck,
            ) -> Result<(), $crate::FlowError> {
                $crate::open::OpenFlow::at(self, x.time).reexamine(&x.x, occasion)
            }

            fn site_outside(&self, x: &$crate::Element<Self>, d: &Self::Vector) -> Option<usize> {
                $crate::open::OpenFlow::at(self, x.time).site_outside(&x.x, &d.v)
            }

            fn defect(&self, x: &$crate::Element<Self>) -> f64 {
                $crate::open::OpenFlow::at(self, x.time).defect(&x.x)
            }

            fn dependent_invariant(&self, x: &$crate::Element<Self>) -> Option<(usize, f64)> {
                $crate::open::OpenFlow::at(self, x.time).dependent_invariant(&x.x)
            }

            fn velocity_terms(
                &self,
                x: &$crate::Element<Self>,
                v: &Self::Vector,
                sizes: &Self::Vector,
            ) -> Option<Self::Vector> {
                let points = $crate::open::OpenFlow::at(self, x.time);
                let terms = points.velocity_terms(&x.x, &v.v, &sizes.v)?;
                Some($crate::open::Beside { v: terms, beside: vec![0.0; v.beside.len()] })
            }

            fn local_error(
                &self,
                x: &$crate::Element<Self>,
                end: &$crate::Element<Self>,
                h: f64,
            ) -> Option<Self::Vector> {
                $crate::open::surrounded::against_simpson(self, x, end, h)
            }
            $(
                fn $visit<V: $crate::step::FlowVisitor<Self>>(&self, visitor: V) -> V::Output {
                    visitor.written(self)
                }
            )?
        }

        impl<$($generics)*> $crate::StageFlow for $flow {
            type Gradients = $crate::open::OpenJets<
                <$closed as $crate::StageFlow>::Gradients,
                <$closed as $crate::Flow>::Numbers,
            >;

            const WEIGHS_ERRORS: bool = $weighs;

            fn gradients(&self, x: &$crate::Element<Self>) -> Option<Self::Gradients> {
                let gradients = $crate::open::OpenFlow::at(self, x.time).gradients(&x.x)?;
                Some($crate::open::surrounded::jets_at(self, x, gradients))
            }

            fn values(&self, jets: &Self::Gradients) -> $crate::Laws<Self::Numbers> {
                jets.values.clone()
            }

            fn velocity(
                &self,
                x: &$crate::Element<Self>,
                jets: &Self::Gradients,
            ) -> Option<(Self::Vector, f64)> {
                $crate::open::surrounded::velocity(self, x, Some(&jets.gradients))
            }

            fn motion(&self, x: &$crate::Element<Self>) -> Option<(Self::Vector, f64)> {
                $crate::open::surrounded::velocity(self, x, None)
            }

            fn stage(&self, x: &$crate::Element<Self>, q: &Self::Vector) -> Option<$crate::Element<Self>> {
                let point = $crate::open::OpenFlow::at(self, x.time).stage(&x.x, &q.v)?;
                Some($crate::open::surrounded::advanced(self, x, &q.beside, point))
            }

            fn stage_rates(
                &self,
                x: &$crate::Element<Self>,
                at: (&Self::Vector, &$crate::Element<Self>),
                v: &Self::Vector,
            ) -> Self::Vector {
                $crate::open::surrounded::stage_rates(self, x, at, v)
            }

            fn stage_coordinates(
                &self,
                x: &$crate::Element<Self>,
                y: &$crate::Element<Self>,
            ) -> Self::Vector {
                let v = $crate::open::OpenFlow::at(self, x.time).stage_coordinates(&x.x, &y.x);
                $crate::open::Beside { v, beside: $crate::open::surrounded::between(self, x, y) }
            }

            fn project(
                &self,
                y: $crate::Element<Self>,
                target: &$crate::explicit::Target<'_, Self>,
            ) -> Result<$crate::explicit::Projected<Self>, $crate::explicit::ProjectionError> {
                let law = $crate::open::OpenFlow::at(self, y.time).entropy_law();
                let has_entropy = law == metriplectic_dynamics::SecondLaw::Exact;
                $crate::open::surrounded::project(self, y, target, has_entropy)
            }
        }

        $crate::open_steps! {
            [$($generics)*] $flow: [R, W] $crate::Scheme<R, W> where
                R: metriplectic_manifolds::Retraction<
                    metriplectic_manifolds::Euclidean<1>,
                    metriplectic_manifolds::Canonical,
                >,
                W: $crate::DiscreteGradient
        }
        $crate::open_steps! { [$($generics)*] $flow: [const STAGES: usize] $crate::Gauss<STAGES> where }
        $crate::open_steps! { [$($generics)*] $flow: [const STAGES: usize] $crate::Radau<STAGES> where }
    };
}

/// The steps of an implicit method of an [`OpenFlow`](crate::open::OpenFlow).
#[doc(hidden)]
#[macro_export]
macro_rules! open_steps {
    ([$($generics:tt)*] $flow:ty: [$($more:tt)*] $method:ty where $($bounds:tt)*) => {
        impl<$($generics)*, $($more)*> $crate::Stepper<$flow> for $method
        where
            $($bounds)*
        {
            type Memory = <Self as $crate::open::OpenSteps>::Memory;

            fn name(&self) -> String {
                $crate::open::OpenSteps::name(self)
            }

            fn order(&self) -> u32 {
                $crate::open::OpenSteps::order(self)
            }

            fn control(&self) -> $crate::Control {
                $crate::open::OpenSteps::control(self)
            }

            fn damps(&self) -> bool {
                $crate::open::OpenSteps::damps(self)
            }

            fn promises(&self, flow: &$flow) -> $crate::Promises {
                let law = $crate::Flow::entropy_law(flow);
                $crate::Promises::all_laws(law == metriplectic_dynamics::SecondLaw::Exact)
            }

            fn serves(&self, flow: &$flow) -> Result<(), $crate::MethodError> {
                $crate::open::OpenSteps::serves(self, flow)
            }

            fn step(
                &self,
                start: &$crate::StepStart<'_, $flow>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<$crate::Taken<$flow>, $crate::StepError> {
                $crate::open::OpenSteps::step(self, start, h, memory)
            }

            fn attempt(
                &self,
                start: &$crate::StepStart<'_, $flow>,
                h: f64,
                memory: &mut Self::Memory,
            ) -> Result<$crate::Taken<$flow>, $crate::Refusal> {
                $crate::open::OpenSteps::attempt(self, start, h, memory)
            }

            fn error(
                &self,
                step: &$crate::StepEnds<'_, $flow>,
                memory: &Self::Memory,
                norm: impl Fn(&<$flow as $crate::Flow>::Vector) -> f64,
            ) -> Option<f64> {
                $crate::open::OpenSteps::error(self, step, memory, norm)
            }

            fn between(
                &self,
                step: &$crate::StepEnds<'_, $flow>,
                memory: &mut Self::Memory,
                theta: f64,
            ) -> Option<$crate::Element<$flow>> {
                $crate::open::OpenSteps::between(self, step, memory, theta)
            }
        }
    };
}
