use firmware::link::*;
use firmware::units::*;
use firmware::pulse::*;
use firmware::safety::*;
use hal_sim::body::*;
use hal_sim::native::native;
use hal_sim::world::*;
fn main(){
  let boot=Micros(0);
  let spec=FingerSpec::participant(wearer::Participant::P);
  let body=Box::new(Finger::new(spec,1).unwrap());
  let mut w=World::new(Box::new(native(boot)),body,boot,Default::default(),1);
  w.outputs=[Some(Output{full_scale:Drive::Volts(60.0),conducted:true});10];
  w.joint_adc=Some((40.0,40.0));
  let mut seq=0u16;
  let mut send=|w:&mut World,session:u16,request:Request|{ let f=encode(&ToDevice{session,seq,request}).unwrap(); seq+=1; w.send(&f);};
  send(&mut w,0,Request::Hello{schema:SCHEMA});
  w.run_until(5000).unwrap();
  let muscle= std::env::args().nth(1).is_none();
  for c in 0..10u8 { 
    send(&mut w,1,Request::Channel{channel:c,spec:ChannelSpec{train:TrainSpec{shape:Shape::BiphasicCathodicFirst,width_us:200,gap_us:100,ground_us:0,period_us:20000,offset_us:c as u32*700,burst_count:1,burst_interval_us:0,repeats:0,triggered:false},stage:StageSpec::Current{full_scale_ua:100000},limit:Amplitude(20000)}});
    if muscle {send(&mut w,1,Request::Muscle{channel:c,force:firmware::muscle::CalciumForceSpec{a_mn_per_s:121900,k_micro:300000,tau_c_us:20800,tau1_us:33100,tau2_us:194400},recruitment:firmware::muscle::RecruitmentSpec{motor_threshold:Amplitude(8000),limit:Amplitude(20000),reference:Amplitude(20000),slope_micro:300000}});}
  }
  send(&mut w,1,Request::Subscribe{period_ms:10});
  send(&mut w,1,Request::Arm);
  w.run_until(50000).unwrap();
  send(&mut w,1,Request::Start);
  w.run_until(60000).unwrap();
  let t0=std::time::Instant::now();
  let mut t=60000u64;
  for _ in 0..(90*30) {
    send(&mut w,1,Request::Amplitudes{mask:1023,values:[Amplitude(15000);10].into_iter().collect()});
    t+=11111; w.run_until(t).unwrap();
    for _ in w.received(){}
  }
  let el=t0.elapsed().as_secs_f64();
  println!("factor {:.0} levels {} dac {}", 30.0/el, w.recorder.trace.levels.len(), w.recorder.trace.dac.len());
}
