//! A method that passes all questions on to another one.

/// The questions of a [`Stepper`](super::Stepper) but for the constants and [`compiled`](super::Stepper::compiled), all of which another
/// method answers.
macro_rules! passed_on {
    ($flow:ty, $this:ident => $other:expr) => {
        fn name(&self) -> String {
            let $this = self;
            $crate::step::Stepper::<$flow>::name(&$other)
        }

        fn order(&self) -> u32 {
            let $this = self;
            $crate::step::Stepper::<$flow>::order(&$other)
        }

        fn promises(&self, flow: &$flow) -> $crate::step::Promises {
            let $this = self;
            $other.promises(flow)
        }

        fn damps(&self) -> bool {
            let $this = self;
            $crate::step::Stepper::<$flow>::damps(&$other)
        }

        fn noise(&self, flow: &$flow) -> Option<$crate::step::NoiseSummary> {
            let $this = self;
            $other.noise(flow)
        }

        fn nothing_between(&self, time: f64, h: f64) -> $crate::step::StepError {
            let $this = self;
            $crate::step::Stepper::<$flow>::nothing_between(&$other, time, h)
        }

        fn on_path(
            &self,
            start: &$crate::step::StepStart<'_, $flow>,
            sizes: [f64; 2],
            memory: &Self::Memory,
        ) -> Option<$crate::step::Element<$flow>> {
            let $this = self;
            $other.on_path(start, sizes, memory)
        }

        fn excursion(
            &self,
            start: &$crate::step::StepStart<'_, $flow>,
            h: f64,
            memory: &Self::Memory,
            excursion: &$crate::step::Excursion<'_, $crate::step::Element<$flow>>,
        ) -> Option<bool> {
            let $this = self;
            $other.excursion(start, h, memory, excursion)
        }

        fn check(&self, follows_tolerance: bool) -> Result<(), $crate::step::MethodError> {
            let $this = self;
            $crate::step::Stepper::<$flow>::check(&$other, follows_tolerance)
        }

        fn serves(&self, flow: &$flow) -> Result<(), $crate::step::MethodError> {
            let $this = self;
            $other.serves(flow)
        }

        fn memory(&self) -> Self::Memory {
            let $this = self;
            $crate::step::Stepper::<$flow>::memory(&$other)
        }

        fn step(
            &self,
            start: &$crate::step::StepStart<'_, $flow>,
            h: f64,
            memory: &mut Self::Memory,
        ) -> Result<$crate::step::Taken<$flow>, $crate::step::StepError> {
            let $this = self;
            $other.step(start, h, memory)
        }

        fn attempt(
            &self,
            start: &$crate::step::StepStart<'_, $flow>,
            h: f64,
            memory: &mut Self::Memory,
        ) -> Result<$crate::step::Taken<$flow>, $crate::step::Refusal> {
            let $this = self;
            $other.attempt(start, h, memory)
        }

        fn control(&self) -> $crate::step::Control {
            let $this = self;
            $crate::step::Stepper::<$flow>::control(&$other)
        }

        fn error(
            &self,
            step: &$crate::step::StepEnds<'_, $flow>,
            memory: &Self::Memory,
            norm: impl Fn(&<$flow as $crate::step::Flow>::Vector) -> f64,
        ) -> Option<f64> {
            let $this = self;
            $other.error(step, memory, norm)
        }

        fn limiting_sites(
            &self,
            step: &$crate::step::StepEnds<'_, $flow>,
            memory: &Self::Memory,
            allowed: &<$flow as $crate::step::Flow>::Vector,
        ) -> $crate::step::LimitingSites {
            let $this = self;
            $other.limiting_sites(step, memory, allowed)
        }

        fn between(
            &self,
            step: &$crate::step::StepEnds<'_, $flow>,
            memory: &mut Self::Memory,
            theta: f64,
        ) -> Option<$crate::step::Element<$flow>> {
            let $this = self;
            $other.between(step, memory, theta)
        }
    };
}
pub(crate) use passed_on;
