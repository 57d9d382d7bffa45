//! The stages of `selfcal` by CLEAN: rounds of images, predictions and gain solutions over a set that stays in memory.

use super::cleaned::{CleanWork, cycles};
use super::held::{COVERAGE, DOUBLE, Held, SINGLE};
use super::image::{InputFormat, fits};
use super::sampled::{RAW, STORED, STORED_ROW};
use super::speeds::Speeds;
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::imaging::{Field, Outlook};

/// A value while a whole set is read, beside what stays of it.
const WHILE_READ: f64 = 25.0;
/// A visibility of a model that is kept for the next image, and the uvw of its row.
const MODEL: f64 = 8.0;
const MODEL_ROW: f64 = 24.0;
/// Images of a round that stay in memory: beam, dirty image, model, residual and restored image.
const IMAGES: f64 = 5.0;
/// Rounds of which one is being made: its own, the one before, and the best.
const STATES: f64 = 3.0;

/// What self-calibration is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationWork {
    /// A deep image, and the verdict.
    pub clean: CleanWork,
    /// Rounds in which the model takes a short step, and rounds with a deep image.
    pub rounds: (f64, f64),
    /// True where baselines are held out: the data are imaged as they are before, and two rounds with all baselines follow.
    pub held_out: bool,
    /// True where the first gains are solved against an image.
    pub from_image: bool,
    /// The transform of the short rounds.
    pub short: Field,
    /// The transform that predicts visibilities for the gain solutions.
    pub predictor: Field,
    /// Gain solutions of a round, each counted once for each of its baselines.
    pub solved: f64,
    /// True where the set stays in memory; otherwise each round reads it again.
    pub stays: bool,
}

/// Values of a block of a set in memory, at most.
const MOST_OF_BLOCK: f64 = (1 << 21) as f64;

/// What the loop does, and what it holds.
struct Loop<'a> {
    held: Held<'a>,
    work: &'a CalibrationWork,
}

impl Loop<'_> {
    fn values(&self) -> f64 {
        self.held.outlook.visibilities() * self.held.outlook.shape.2 as f64
    }

    fn out(&self) -> f64 {
        self.held.outlook.channels_out as f64
    }

    /// 1 where baselines are held out.
    fn judging(&self) -> f64 {
        if self.work.held_out { 1.0 } else { 0.0 }
    }

    /// Images in short rounds and before the first, and deep images.
    fn images(&self) -> (f64, f64) {
        let (short, deep) = self.work.rounds;
        (short + if self.work.from_image { 1.0 } else { 0.0 }, deep + 3.0 * self.judging())
    }

    /// Gain solutions.
    fn solutions(&self) -> f64 {
        self.work.rounds.0 + self.work.rounds.1 + 2.0 * self.judging()
    }

    /// The set, where it stays in memory.
    fn set(&self) -> f64 {
        if self.work.stays { self.values() * RAW + self.held.rows() * COVERAGE } else { 0.0 }
    }

    /// The images of a round.
    fn state(&self) -> f64 {
        self.out() * self.held.plane(IMAGES * DOUBLE)
    }

    fn block(&self) -> f64 {
        self.values().min(MOST_OF_BLOCK)
    }

    /// A predictor: its planes, and the nodes and the columns of its last turn, which it keeps for the next one.
    fn predictor(&self) -> f64 {
        let p = &self.work.predictor;
        let nodes = p.pass.nodes * 2.0 * p.real_bytes as f64 * self.block() / self.values().max(1.0);
        let kept = (nodes + p.size.column_buffers as f64).min(self.held.outlook.memory.kept_buffers() as f64);
        self.out() * (p.size.plane_bytes as f64 + kept)
    }

    /// What stays in memory all the time: the set, the predictions of the model, images and predictors of the rounds, and the scales.
    fn always(&self) -> f64 {
        let model = self.held.outlook.visibilities() * MODEL + self.held.rows() * MODEL_ROW;
        let model = model.min(self.held.outlook.memory.kept_model() as f64);
        self.set() + model + (STATES - 1.0) * (self.state() + self.predictor()) + self.held.scales(&self.work.clean)
    }

    /// Reading the set: once, or for each image and each solution.
    fn read(&self, format: InputFormat) -> Stage {
        let (bytes, times) = if self.work.stays {
            (self.set() + self.values() * WHILE_READ, 1.0)
        } else {
            (self.held.reading(), 1.0 + self.images().0 + self.images().1 + self.solutions())
        };
        let stage = Stage { read_bytes: times * self.held.file(), ..Stage::new("read", bytes) };
        stage.doing([(format.term(), times * self.values()), (Term::ReadRow, times * self.held.rows())])
    }

    /// The images of all rounds.
    fn imaged(&self, cycles: f64) -> Vec<Stage> {
        let (held, image, (short, deep)) = (self.held, &self.held.outlook.image, self.images());
        let beside = self.always() + held.plane(2.0 * SINGLE);
        let times = |stage: Stage, n: f64| Stage { work: stage.work.iter().map(|(t, k)| (*t, k * n)).collect(), ..stage };
        let clean = &self.work.clean;
        let bytes = held.minor(clean, 1.0, self.always() + held.pass(image) + held.planes_between(2.0)).bytes;
        // All short rounds together find about as many components as one deep image.
        let short_rounds = held.minor(clean, short, 0.0).work;
        let deep_images = times(held.minor(clean, cycles, 0.0), deep);
        let mut stages = vec![
            times(held.imaged("beams", image, (true, self.always())), 1.0 + 2.0 * self.judging()),
            times(held.imaged("images of short rounds", &self.work.short, (true, beside)), short),
            times(held.imaged("deep images", image, (true, beside)), deep),
            held.residuals(deep * cycles, beside),
            Stage { bytes, ..deep_images }.doing(short_rounds),
        ];
        stages.extend(held.drawn(clean, cycles, beside).map(|stage| times(stage, deep)));
        stages
    }

    /// The predictions of the models of all rounds, and the gains.
    fn solved(&self) -> [Stage; 2] {
        let (p, values, images) = (&self.work.predictor, self.values(), self.images().0 + self.images().1);
        let block = self.block() * (RAW + MODEL);
        let made = self.predictor().max(self.held.plane(DOUBLE) + p.size.column_bytes as f64);
        let predictions = Stage::new("predictions", self.always() + self.state() + made + block);
        let gains = Stage::new("gains", self.always() + block);
        [
            predictions.doing(self.held.predicted(p, images)).doing([(Term::Sort, images * p.pass.nodes)]),
            gains.doing([
                (Term::Sum, (self.solutions() + self.judging() * images) * values),
                (Term::Solve, self.solutions() * self.work.solved),
            ]),
        ]
    }
}

/// The forecast of self-calibration.
#[must_use]
pub fn selfcal(outlook: &Outlook, (format, threads): (InputFormat, usize), work: &CalibrationWork, speeds: &Speeds) -> Forecast {
    let held = Held { outlook, threads };
    let all = Loop { held, work };
    let (values, images, cycles) = (all.values(), all.images().0 + all.images().1, cycles(&work.clean, speeds));
    let weighed = held.weigh().work.into_iter().map(|(term, n)| (term, n * images));
    let calibrated = Stage::new("calibrated rows", all.always() + held.data(true) + held.raw()).doing(weighed);
    let output = Stage::new("calibrated set", all.always() + 2.0 * all.block() * RAW);
    let mut stages =
        vec![held.start(), all.read(format), calibrated.doing([(Term::Apply, images * values), (Term::ReadUvh5, images * values)])];
    stages.extend(all.imaged(cycles));
    stages.extend(all.solved());
    stages.push(output.doing([(Term::Apply, values), (Term::WriteGains, values), (Term::GainRow, held.rows())]));
    stages.push(held.write(IMAGES + images, all.always()));
    stages.extend(work.clean.judged.as_ref().map(|field| held.verdict((field, true), all.always() + all.state())));
    let (rounds, components) = (work.rounds.0 + work.rounds.1, work.clean.components);
    let assumptions = vec![
        format!("all {rounds} rounds of --rounds are made: they end earlier where they no longer improve the image"),
        format!(
            "a deep image takes all {components} components of --niter in {cycles:.1} major cycles, and the short rounds together as many"
        ),
        "how many rounds, cycles and components the data ask for is not known before: the time can be half or twice as long".into(),
        "holes between arrays take a thirtieth of the memory: they can take a tenth".into(),
    ];
    let output_bytes = fits(outlook, IMAGES + images) + values * STORED + held.rows() * STORED_ROW;
    Forecast { stages, output_bytes, assumptions, groups_of_planes: outlook.image.size.groups }
}
